// What a segment of the black box says of itself, and of those before it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/digest/digest.hpp"

namespace perimap::black_box {

// A segment that was there when a later one began.
struct PresentSegment {
  std::uint64_t number = 0;
  std::uint64_t entries = 0;
  std::uint64_t bytes = 0;  // of its entries, and of what stands before them
  Digest digest{};          // of its last entry
  // What stands behind: an entry that was written in part, or what somebody has changed. It stays as it is.
  std::uint64_t remainder_bytes = 0;
  Digest remainder{};  // of those bytes; zeros where there are none
  bool kept = false;   // because of an event
  std::int64_t last_utc_ns = 0;

  bool operator==(const PresentSegment&) const = default;
};

struct SegmentHeader {
  std::uint64_t number = 0;
  std::string program;                  // and its version
  std::string source;                   // whose
  std::string run;                      // as published samples have it, in hexadecimal digits
  std::vector<PresentSegment> present;  // before it, in order of number

  bool operator==(const SegmentHeader&) const = default;
};

// As JSON, on one line, and back. Any text is safe; an error says what was expected.
[[nodiscard]] std::string text_of(const SegmentHeader& header);
[[nodiscard]] Expected<SegmentHeader> parse_header(std::string_view text);

}  // namespace perimap::black_box

// Reads a segment of the black box and says how much of it is as it was written.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"
#include "daemon/black_box/entry.hpp"
#include "daemon/black_box/segment_header.hpp"
#include "daemon/digest/digest.hpp"

namespace perimap::black_box {

struct SegmentFacts {
  SegmentHeader header;       // as far as there are entries
  std::uint64_t entries = 0;  // that are as they were written, one after the other from the first
  std::uint64_t bytes = 0;    // of them, and of what stands before them
  Digest digest{};            // of the last of them
  std::int64_t first_utc_ns = 0;
  std::int64_t last_utc_ns = 0;
  bool ended = false;  // by an entry that says so, and nothing is behind it
  // Why reading stopped before the end of the bytes: "entry 7, byte 1234: ...". None: all of them are entries.
  std::string fault;
  // Nothing was changed as far as can be told: the last entry is there in part, as when the machine stopped.
  bool torn = false;

  [[nodiscard]] bool whole() const noexcept { return ended && fault.empty(); }
};

// Any bytes are safe. `see` is given each entry that is as it was written; it may be empty.
[[nodiscard]] SegmentFacts read_segment(std::string_view bytes, const std::function<void(const Entry&)>& see);

}  // namespace perimap::black_box

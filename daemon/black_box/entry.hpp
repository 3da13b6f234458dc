// The entries of a black box, and how a file of it (a segment) has them.
//
// "PERIMAPB", format (u32), then entries, little-endian: length of the content (u32), kind (u8), three zeros, monotonic
// and UTC instant in ns (i64 each), the content, and SHA-256 of the digest before and of all of this entry. Before the
// first entry the digest is that of the eight letters and the format.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/digest/digest.hpp"

namespace perimap::black_box {

enum class EntryKind : std::uint8_t {
  kHeader = 1,     // JSON: a segment's first entry
  kConfiguration,  // TOML, of all keys
  kSurface,        // CDR, as recordings have it; likewise:
  kPhase,
  kStatus,
  kCommand,  // JSON: what was asked for, and what came of it
  kEvent,    // JSON: why what lies around it is kept
  kLog,      // a line of the log, its severity before it
  kLost,     // JSON: what could not be written
  kLetGo,    // JSON: a segment that is no more, and why
  kEnd       // JSON: a segment's last entry
};
inline constexpr EntryKind kLastKind = EntryKind::kEnd;

[[nodiscard]] std::string_view kind_name(EntryKind kind) noexcept;

// One instant by two clocks: CLOCK_MONOTONIC and UTC.
struct Stamp {
  std::int64_t monotonic_ns = 0;
  std::int64_t utc_ns = 0;
};

struct Entry {
  EntryKind kind = EntryKind::kLog;
  Stamp at;  // when it was told
  std::string_view content;
};

inline constexpr std::string_view kSegmentMagic = "PERIMAPB";
inline constexpr std::uint32_t kSegmentFormat = 1;
inline constexpr std::size_t kEntryHead = 24;
inline constexpr std::size_t kEntryFrame = kEntryHead + sizeof(Digest);  // beside the content
// More than any sample of 1000 features, so that a damaged length cannot ask for the machine's memory.
inline constexpr std::size_t kLongestContent = std::size_t{4} << 20;

// What a segment begins with, and its digest.
[[nodiscard]] std::string segment_begin();
[[nodiscard]] Digest begin_digest();

// The entry as a segment has it behind `chain`, which becomes its digest.
[[nodiscard]] std::string frame_of(const Entry& entry, Digest& chain);

}  // namespace perimap::black_box

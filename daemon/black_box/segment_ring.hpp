// The segments of a black box: the last minutes of everything, and what lies around an event.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/black_box/entry.hpp"
#include "daemon/black_box/segment_file.hpp"
#include "daemon/black_box/segment_header.hpp"
#include "drivers/file/descriptor.hpp"

namespace perimap::black_box {

struct RingLimits {
  std::chrono::nanoseconds ring = std::chrono::minutes(5);      // what is not kept goes after this
  std::chrono::nanoseconds keep = std::chrono::hours(24 * 30);  // and what is kept after this
  std::uint64_t bytes = std::uint64_t{1} << 30;                 // of all of them
};

// A segment spans so long at most; so long before and after an event is kept.
inline constexpr std::chrono::seconds kSegmentSpan{30};
inline constexpr std::chrono::seconds kKeptBefore{60};
inline constexpr std::chrono::seconds kKeptAfter{30};

// Why a segment ends.
inline constexpr std::string_view kRunHasEnded = "perimapd has ended";
inline constexpr std::string_view kNextGoesOn = "the next segment goes on";

// Used by one thread. Errors name the file.
class SegmentRing {
 public:
  using Clock = std::function<Stamp()>;

  // Takes up what earlier runs have left in the folder, which is made where it is missing. Another process that writes
  // there is an error. `whose`: number and segments before it are filled in.
  [[nodiscard]] static Expected<SegmentRing> open(const std::filesystem::path& folder, const RingLimits& limits,
                                                  SegmentHeader whose, Clock clock);

  // What was found by open() and at the beginning of segments, to be told once: an earlier run that did not end, a
  // segment that others have removed.
  [[nodiscard]] std::vector<std::string> take_findings();

  // Into the segment that is open; one is begun where there is none, or the one before is full or old.
  [[nodiscard]] Expected<void> write(const Entry& entry);
  // What each segment has beside its header, from the next on; and the open one, too.
  [[nodiscard]] Expected<void> write_configuration(const Stamp& at, std::string toml);
  // What lies around now is kept.
  void keep_around_now();
  [[nodiscard]] Expected<void> synchronise();
  // Ends the open segment.
  [[nodiscard]] Expected<void> end(std::string_view why);

  // The last entry that was written: what the log tells, so that a chain that was made anew does not pass.
  [[nodiscard]] Digest digest() const { return file_ ? file_->facts().digest : last_digest_; }

 private:
  SegmentRing(std::filesystem::path folder, const RingLimits& limits, SegmentHeader whose, Clock clock,
              Descriptor lock);
  [[nodiscard]] Expected<void> take_up();
  [[nodiscard]] Expected<void> begin_segment();
  [[nodiscard]] Expected<void> write_now(EntryKind kind, std::string_view content);
  [[nodiscard]] Expected<void> tell_let_go();
  void remove_let_go();
  void notice_removed();
  void let_go_of_old(std::int64_t utc_ns);
  void let_go(std::size_t index, std::string_view why);
  [[nodiscard]] std::uint64_t segment_bytes() const;

  std::filesystem::path folder_;
  RingLimits limits_;
  SegmentHeader whose_;
  std::string configuration_;
  Clock clock_;
  Descriptor lock_;
  std::vector<PresentSegment> present_;  // ended, in order of number
  std::optional<SegmentFile> file_;
  bool file_kept_ = false;
  std::int64_t file_began_ns_ = 0;  // monotonic
  std::int64_t keep_until_ns_ = 0;  // likewise
  std::uint64_t next_number_ = 1;
  Digest last_digest_{};
  std::vector<std::string> findings_;
  std::vector<std::string> let_go_;   // entries that the open segment is to have
  std::vector<std::uint64_t> going_;  // segments to be removed once it has them
};

// Of an entry of that kind: which segment is no more; nothing where it does not tell.
[[nodiscard]] std::optional<std::uint64_t> let_go_number(std::string_view content);
// Likewise of it, and of a segment's last entry: why; empty where it does not tell.
[[nodiscard]] std::string why_of(std::string_view content);
// Why one is let go that perimapd has not removed.
inline constexpr std::string_view kRemovedByOthers = "removed by others, as by perimap forget";

}  // namespace perimap::black_box

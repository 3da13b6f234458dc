// Which surface is due next, of the frames' and of the clock's.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/pipeline/release_schedule.hpp"
#include "core/pipeline/release_stream.hpp"
#include "core/sensors/frame_stamp.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct ReleasePlanSettings {
  Duration latency{0};                // L of the frames' releases
  bool frame_stream = true;           // these are published
  Duration clock_period{0};           // the clock's releases fall on the multiples of it; 0: there are none
  Duration usable = Duration::max();  // a surface serves nobody longer after its release: lead and validity
};

// How many releases of each stream are left out.
using MissedReleases = std::array<std::uint64_t, kReleaseStreams.size()>;

// The frames' releases, as ReleaseSchedule has them, and those on the clock's grid, in order of time; of two at the
// same instant the frame's comes first. A release of the clock tells which frame's surface ought to be known by then:
// the last whose capture + L has come, whether or not the frames' own releases are published. The grid begins with the
// first such frame. Used by one thread.
class ReleasePlan {
 public:
  explicit ReleasePlan(const ReleasePlanSettings& settings) noexcept : settings_(settings), frames_(settings.latency) {}

  // As ReleaseSchedule::on_frame(). `now` may be long after the arrival, when the publisher was held up.
  bool on_frame(const FrameStamp& stamp, Instant now) noexcept;
  // As ReleaseSchedule::resume().
  void resume(Instant last_capture, Duration period, Instant now) noexcept {
    frames_.resume(last_capture, period, now);
  }

  // The next release; none before the first frame. While it is provisional, a frame that comes may change it.
  [[nodiscard]] std::optional<Release> next() const noexcept;
  [[nodiscard]] static bool provisional(const Release& release) noexcept {
    return release.frame_missing || release.stream == ReleaseStream::kClock;
  }
  // Takes it off the plan. Requires next().
  Release take_release() noexcept;

  // Nobody can use this release's surface any more.
  [[nodiscard]] bool stale(const Release& release, Instant now) const noexcept {
    return now - release.deadline > settings_.usable;
  }
  // Leaves out what it is too late for: the clock's releases after which another one has come due as well; of the
  // frames' those that are stale, and the oldest of more than kMostTogether. Returns how many since the last call.
  MissedReleases leave_out_missed(Instant now) noexcept;
  // Through a gap in a recording, at once however long it is: as ReleaseSchedule::pass_over(), and the clock's
  // likewise. Returns how many releases of the published streams are passed over.
  std::uint64_t pass_over(Instant now) noexcept;
  // Where the frames' releases are not published: lets those that have come due by `now` come due, so that last_due()
  // and last_owed() are no older than this call, however slow the clock is.
  void let_come_due(Instant now) noexcept;

  // Frames that have come are still to be released, or to be told of by the clock.
  [[nodiscard]] bool pending() const noexcept { return frames_.pending(); }
  // The frame's release that came due last; the capture is zero when there was none.
  [[nodiscard]] const Release& last_due() const noexcept { return due_; }
  // The number of the newest frame among those, whether or not frames were missing since; 0 before the first.
  [[nodiscard]] std::uint64_t last_owed() const noexcept { return owed_; }
  [[nodiscard]] Duration frame_period() const noexcept { return frames_.period(); }

  // Frames' releases that have come due meanwhile follow one upon the other: half of what readers keep.
  static constexpr int kMostTogether = 8;

 private:
  [[nodiscard]] bool missed(const std::optional<Release>& frame, Instant now) const noexcept;
  void leave_out_frame() noexcept;
  void take_frame() noexcept;
  [[nodiscard]] std::optional<Instant> next_on_grid() const noexcept;
  void let_frames_come_due(Instant until) noexcept;

  ReleasePlanSettings settings_;
  ReleaseSchedule frames_;
  bool any_due_ = false;
  Release due_;
  std::uint64_t owed_ = 0;
  bool grid_begun_ = false;
  Instant last_on_grid_;
  MissedReleases missed_{};  // not told yet
};

}  // namespace perimap

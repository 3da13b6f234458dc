// When each frame's surface is due, whether or not the frame comes.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/pipeline/release_stream.hpp"
#include "core/sensors/frame_stamp.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// One surface that is due.
struct Release {
  std::uint64_t frame_sequence = 0;  // 0 as well before the first frame of this run
  Instant capture;                   // of the frame, or where the fitted frame rate puts it
  Instant deadline;                  // capture + L; of the clock's stream an instant of its grid
  bool frame_missing = false;        // no frame has come for this release
  ReleaseStream stream = ReleaseStream::kFrame;
};

// As many frames at most are between their capture and their release: L x the frame rate must not exceed it.
inline constexpr int kMostFramesUnderway = 240;

// Every frame is released at capture + L. Where a frame is missing (dropped, or the camera has stopped) the release
// happens all the same, at the time that the fitted frame period gives. Used by one thread.
class ReleaseSchedule {
 public:
  explicit ReleaseSchedule(Duration latency) noexcept : latency_(latency) {}

  // A frame's stamps, in order of arrival. False when it comes too late: it arrived after its release time, or a later
  // release was taken; it then only helps to fit the frame times. One that arrived in time is released as that frame
  // however late this is called.
  bool on_frame(const FrameStamp& stamp) noexcept;

  // Before the first frame: releases go on as after a frame of then, on its frame times, the next one after `now`. They
  // have no numbers: this run counts its own frames.
  void resume(Instant last_capture, Duration period, Instant now) noexcept;

  // No frame has come for a long time, and nobody waits for what is due until `now`: the next release is the first
  // after it, at once however long that is. Returns how many were passed over. Does nothing while frames are pending.
  std::uint64_t pass_over(Instant now) noexcept;

  // The next release; none before the first frame. With frame_missing it is provisional: a frame that arrives before
  // its deadline may replace it.
  [[nodiscard]] std::optional<Release> next() const noexcept;

  // Frames that have come are still to be released.
  [[nodiscard]] bool pending() const noexcept { return head_ != tail_; }

  // Takes the next release off the schedule. Requires next().
  Release take_release() noexcept;

  [[nodiscard]] Duration period() const noexcept { return period_; }

 private:
  // Some more than are underway, for what a publisher that was held up has yet to release.
  static constexpr std::uint64_t kCapacity = kMostFramesUnderway + 16;

  void fit(const FrameStamp& stamp) noexcept;
  void fit(Duration period) noexcept;

  Duration latency_;
  std::array<FrameStamp, kCapacity> pending_{};
  std::uint64_t head_ = 0;
  std::uint64_t tail_ = 0;
  bool have_last_ = false;
  bool last_missing_ = false;  // the last release taken was of no frame
  bool numbered_ = false;      // a release of a frame was taken
  Instant last_capture_;       // of the last release taken
  std::uint64_t last_sequence_ = 0;
  bool have_fit_ = false;
  FrameStamp fitted_;   // newest stamp that went into the fit
  Duration period_{0};  // 0: not known yet
  // The newest period that was not like `period_`, and how many like it have come in a row.
  Duration other_period_{0};
  int others_ = 0;
};

}  // namespace perimap

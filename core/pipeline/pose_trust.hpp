// The camera's pose at a frame, and whether what tells it may be believed.
#pragma once

#include <cstdint>
#include <optional>

#include "core/pipeline/frame_doubts.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/parallax.hpp"
#include "core/pipeline/picture_loop.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pose_history.hpp"
#include "core/pipeline/repeats.hpp"
#include "core/pipeline/scope_watch.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// The pose comes of the tracker's readings and, of a scope that turns in its camera head, of how that is turned. Where
// a reading or a picture is the one before given again and again, or the turn is not known, there is none; and that may
// be found out some frames late. All members are called by the mapper thread; nothing is allocated.
class PoseTrust {
 public:
  // What is told at a frame's beginning.
  struct Told {
    CameraPose pose;                              // missing where what tells it is not believed
    std::optional<std::uint64_t> mistaken_since;  // the poses of the frames from this one on were mistaken
  };

  // `scope`: null where pictures are not asked how the scope is turned; it and the counters must outlive this.
  // `may_loop`: the camera is a video that is played in a loop, as whoever set it up knows.
  PoseTrust(const PoseHistorySettings& settings, ScopeWatch* scope, PipelineCounters& counters,
            bool may_loop = false) noexcept
      : poses_(settings), scope_(scope), counters_(counters), may_loop_(may_loop) {}

  void add(const TrackerSample& sample) noexcept;
  // Of the second tracked sensor that tells how the scope is turned.
  void add_second(const TrackerSample& sample) noexcept;

  // The tracker has told all about instant t that it will: no need to wait longer.
  [[nodiscard]] bool reached(Instant t) const noexcept {
    return poses_.reached(t) && (scope_ == nullptr || scope_->reached(t));
  }
  // When the newest reading came.
  [[nodiscard]] Instant last_arrival() const noexcept { return last_arrival_; }

  // Once a frame, when it has been appended to the history: fills in whether its picture is the one before, and how the
  // scope has it. The caller gives it the pose, after the frames whose poses were mistaken have lost theirs.
  [[nodiscard]] Told begin_frame(FrameRecord& frame, const FrameHistory& history, const GreyImage& image,
                                 const GreyImage& before) noexcept;
  // Of that frame; what the set-up may be off by is not in it.
  [[nodiscard]] const FrameDoubts& doubts() const noexcept { return doubts_; }

  // Once a frame when its surface has been handed over.
  void offer(const FrameRecord& frame, const GreyImage& image) noexcept {
    if (scope_ != nullptr) scope_->offer(frame.index, frame.rate, image);
  }

 private:
  void heed_repeats(const FrameRecord& frame, const FrameHistory& history, Told& told) noexcept;

  PoseHistory poses_;
  ScopeWatch* scope_;
  PipelineCounters& counters_;

  Instant last_arrival_;
  std::optional<Pose> last_reading_;  // of the tracker; none where it was not valid
  Repeats pose_repeats_;
  Repeats picture_repeats_;
  PictureLoop loop_;
  bool may_loop_;
  Parallax parallax_;
  FrameDoubts doubts_;
};

}  // namespace perimap

// How the scope is turned in its camera head: from the pictures, by whole readings of the field stop by housekeeping,
// on a thread of its own, adopted at stated frames, and by each frame's own notch; or by a second tracked sensor.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/scope_turn.hpp"
#include "core/pipeline/sensed_turn.hpp"
#include "core/pipeline/unchanged_scope.hpp"
#include "core/realtime/background_round.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "core/time/frame_rate.hpp"

namespace perimap {

// One picture at a time: the mapper copies it, and takes what was read at the frame that was stated then. In lockstep
// that is waited for; else a reading that is not there in time is lost and counted. serve() belongs to the housekeeping
// thread, all else to the mapper.
class ScopeWatch {
 public:
  // Of one frame.
  struct Frame {
    std::optional<ScopeState> state;              // where the turns are calibrated and this frame's is known
    bool unread = false;                          // where they are calibrated: it is not known
    bool changed = false;                         // where they are not: it is another than at first
    std::optional<std::uint64_t> mistaken_since;  // the poses of the frames from this one on rest on a wrong turn
    std::optional<Instant> mistaken_from;         // likewise, of those captured then and later
  };

  ScopeWatch(const PipelineSettings& settings, PipelineCounters& counters);

  // Of the tracked sensor, and of the second one.
  void add_pose(const TrackerSample& sample) noexcept;
  void add_second_pose(const TrackerSample& sample) noexcept;
  // Waiting longer for a second sensor's pose can not improve what is told of t.
  [[nodiscard]] bool reached(Instant t) const noexcept { return !sensed_ || sensed_->reached(t); }

  // Once a frame before its pose is asked for.
  [[nodiscard]] Frame begin_frame(std::uint64_t frame_index, Instant capture, const GreyImage& image) noexcept;

  // Once a frame when its surface has been handed over.
  void offer(std::uint64_t frame_index, const FrameRate& rate, const GreyImage& image) noexcept;

  // Until dismiss().
  void serve() noexcept;
  void dismiss() noexcept;

 private:
  [[nodiscard]] bool calibrated() const noexcept { return turn_ || sensed_; }
  [[nodiscard]] std::optional<std::uint64_t> adopt(std::uint64_t frame_index) noexcept;
  [[nodiscard]] std::optional<std::uint64_t> adopt_reading(const std::optional<FieldStopReading>& reading) noexcept;
  void count(const Frame& frame) noexcept;

  int width_;
  int height_;
  BackgroundRound hand_over_;  // of a whole reading
  PipelineCounters& counters_;

  // The mapper's own.
  std::optional<ScopeTurn> turn_;     // the turns are calibrated, and the field stop tells them
  std::optional<SensedTurn> sensed_;  // the turns are calibrated, and a second sensor tells them
  UnchangedScope unchanged_;          // where they are not calibrated
  std::uint64_t begun_at_ = 0;
  std::uint64_t adopted_at_ = 0;
  std::uint64_t next_at_ = 0;
  std::uint64_t agreed_at_ = 0;           // the last picture whose whole reading told what its frame was told
  int failed_ = 0;                        // whole readings in a row
  std::optional<TurnReading> seen_then_;  // in the picture that is being read

  // Handed over: housekeeping's while a reading is under way.
  std::vector<std::uint8_t> pixels_;
  std::optional<FieldStopReading> reading_;
};

}  // namespace perimap

// How far an angled scope is turned in its camera head, frame by frame, by a second tracked sensor; and the set-up
// then.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/pipeline/held_turn.hpp"
#include "core/pipeline/pose_history.hpp"
#include "core/pipeline/repeats.hpp"
#include "core/pipeline/scope_state.hpp"
#include "core/sensors/tracker_sample.hpp"

namespace perimap {

// One sensor sits on the camera head and one on the scope, so that one turns about the shaft's axis in the frame of the
// other. What they told in the tenth of a second before a capture is one reading, so that a scope that is being turned
// stands out from a tracker's noise. A frame at whose capture either is not seen has no state, and neither has one at
// which they are turned otherwise than about that axis: one of them has slipped. A second sensor whose readings repeat
// bit for bit while the first one's go on is not seen either (decision 80). No heap after construction.
class SensedTurn {
 public:
  // `scope` has a second sensor; `lens`: as calibrated; `tracker`: of both sensors, its hand-eye aside.
  SensedTurn(const TurnedScope& scope, const CameraModel& lens, const PoseHistorySettings& tracker);

  // Of the sensor S, and of the second one, each in the order of its stamps.
  void add(const TrackerSample& sensor) noexcept;
  void add_second(const TrackerSample& second) noexcept;
  // Waiting longer for the second sensor can not improve what is told of t.
  [[nodiscard]] bool reached(Instant t) const noexcept { return second_.poses.reached(t); }

  // The state at a frame's capture.
  [[nodiscard]] std::optional<ScopeState> at(Instant capture) noexcept;

  // Since when the second sensor's readings have been one and the same; told once, when that is known.
  [[nodiscard]] std::optional<Instant> take_stuck_since() noexcept;

  [[nodiscard]] std::uint64_t turns() const noexcept { return states_.turns(); }

 private:
  struct Sensor {
    explicit Sensor(const PoseHistorySettings& settings) : poses(settings) {}
    void add(const TrackerSample& sample) noexcept;

    PoseHistory poses;
    Repeats repeats;
    std::optional<Pose> last;  // reading; none where it was not valid
  };

  // Of one frame, with what no mean of frames takes from its variance: the error they have in common, and the lag.
  struct Reading {
    TurnReading own;
    double lasting_variance_rad2 = 0.0;
  };

  static constexpr std::uint64_t kTimes = 256;  // a tenth of a second of any tracker, and more

  [[nodiscard]] bool stuck() const noexcept;
  [[nodiscard]] std::optional<Reading> read(Instant capture) const noexcept;

  PoseHistorySettings settings_;
  ScopeStates states_;
  Sensor sensor_;
  Sensor second_;
  std::array<Instant, kTimes> times_{};  // of the second sensor's readings, on the camera's clock
  std::uint64_t count_ = 0;
  HeldTurn held_;
  bool stuck_told_ = false;
};

}  // namespace perimap

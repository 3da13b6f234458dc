// The set-up of an angled scope as a function of its turn, where a second tracked sensor tells that turn.
#pragma once

#include <vector>

#include "core/calibration/held_stretches.hpp"
#include "core/calibration/timed_poses.hpp"
#include "core/calibration/turned_scope.hpp"
#include "core/error/expected.hpp"

namespace perimap {

// While the scope is held at one turn: the second sensor's orientation in the frame S of the first one.
struct HeldRelation {
  Matrix3d R_S2 = Matrix3d::Identity();
  double deviation_rad = 0.0;  // standard deviation per axis, of the mean, by the means over a second
  double spread_rad = 0.0;     // RMS of the means over a second about it, per axis
};

// Over which a mean of both is taken, to follow the turn: half a second, or as long as a slow tracker needs for six
// poses.
[[nodiscard]] double relation_window_s(const std::vector<TimedPose>& second);

// The second sensor's orientation in the frame of the first, by the mean of each so many seconds in which both are
// seen. Each of both in the order of its times, on one clock.
[[nodiscard]] std::vector<TimedTurn> relations_over(const std::vector<TimedPose>& sensor,
                                                    const std::vector<TimedPose>& second, double each_s);

// Likewise of all of the time. Fails, and says what is missing, when they are hardly seen
// together, or one turned against the other meanwhile.
[[nodiscard]] Expected<HeldRelation> held_relation(const std::vector<TimedPose>& sensor,
                                                   const std::vector<TimedPose>& second);

// From calibrations at three turns and more, 20 degrees apart and more, and the relation at each; the result has a
// second sensor. The way round is the one that leaves less of the hand-eyes; the picture's centre of turning is the one
// about which their principal points go. Zoom is not told of. Fails as fit_turned_scope() does, and when the second
// sensor does not turn, or not about one axis.
[[nodiscard]] Expected<TurnedScope> fit_by_second_sensor(std::vector<SetupAtRotation> setups,
                                                         const std::vector<HeldRelation>& held);

}  // namespace perimap

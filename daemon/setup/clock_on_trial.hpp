// How far off the clocks of camera and tracker are, by what a set-up on trial leaves over.
#pragma once

#include <optional>
#include <vector>

#include "core/calibration/timed_poses.hpp"
#include "core/geometry/pose.hpp"

namespace perimap {

struct ClockError {
  double change_s = 0.0;  // to be added to the offset on trial
  double deviation_s = 0.0;
};

// What AX = XB leaves over goes with the sensor's twist as far as the clocks are off. Least squares over that twist and
// over errors of hand-eye and board, weighted by the noise that is new in each of the tracker's poses; the deviation is
// of errors that last (Newey and West). `camera` is X_BC and `sensor` X_WS, each on its own clock; `offset_s` is added
// to the tracker's times to get the camera's. None where fewer than twenty views have a pose, or nothing moves.
[[nodiscard]] std::optional<ClockError> clock_error(const std::vector<TimedPose>& camera,
                                                    const std::vector<TimedPose>& sensor, const Pose& X_SC,
                                                    double offset_s);

}  // namespace perimap

// How fast a hand moved a scope now and then: what tells the times of two clocks from errors that last.
#pragma once

#include <vector>

#include "core/calibration/timed_poses.hpp"

namespace perimap {

// RMS of the angular speed about its mean over half a second around each pose, rad/s. Of the camera's poses, for a
// tracker's noise looks brisk. `poses` in the order of their times; 0 where they are more than 0.3 s apart.
[[nodiscard]] double brisk_speed(const std::vector<TimedPose>& poses);

}  // namespace perimap

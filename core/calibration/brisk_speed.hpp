// How fast a hand moved a scope now and then: what tells the times of two clocks from errors that last.
#pragma once

#include <vector>

#include "core/calibration/hand_eye_closed_form.hpp"

namespace perimap {

// RMS of the angular speed about its mean over half a second around each pose, rad/s: of the part that camera and
// tracker have in common, for the noise of either alone looks brisk. `pairs` in the order of their times, on one clock;
// `R_SC` of the hand-eye. 0 where they are more than 0.3 s apart, or have nothing in common.
[[nodiscard]] double brisk_speed(const std::vector<PosePair>& pairs, const Matrix3d& R_SC);

}  // namespace perimap

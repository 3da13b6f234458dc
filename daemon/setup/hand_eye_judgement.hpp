// What a hand-eye calibration is worth by its own poses: beside those that it was not fitted to, and from one pose to
// another.
#pragma once

#include "daemon/setup/hand_eye.hpp"

namespace perimap {

// Of a result that has pairs, places and the errors' covariance. Fills fitted_rms_mm, held_aside_rms_mm and
// held_aside_rms_deg: each fifth of the time is judged by places that the other four have told.
void judge_held_aside(HandEyeCalibration& result);

// Fills disagreements_mm, their median and its deviation, and what OpenCV's solvers leave over beside it: the
// translation of AX - XB over all pairs of poses a second apart, or of each pose and the next where they were taken at
// rest. `camera_interval_s`: between the camera's poses.
void judge_motions(HandEyeCalibration& result, double camera_interval_s);

}  // namespace perimap

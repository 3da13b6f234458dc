// How steps of the two places that hand-eye calibration looks for are felt in its error.
#pragma once

#include <Eigen/Core>

#include "core/geometry/pose.hpp"

namespace perimap {

// What hand_eye_error() gains, to first order and but for its sign, by small steps of where the board is in W (columns
// 0 to 5: rotation about `middle_W`, rad, then translation, mm) and of where the camera is in the sensor (columns 6 to
// 11), while the sensor is at X_WS. The latter are in S and the same at all poses.
[[nodiscard]] Eigen::Matrix<double, 6, 12> felt_in_sensor(const Pose& X_WS, const Vector3d& middle_W);

}  // namespace perimap

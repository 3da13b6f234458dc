#include "core/calibration/second_sensor.hpp"

#include <cmath>

#include "core/angle/angle.hpp"

namespace perimap {

// The twist about the axis (swing and twist of a quaternion): the one of all turns about it that leaves least.
double SecondSensor::rotation_rad(const Matrix3d& R_S2) const noexcept {
  const Eigen::Quaterniond turn(Matrix3d(R_S2 * reference_S2.transpose()));
  return std::remainder(2.0 * std::atan2(turn.vec().dot(axis_S), turn.w()), kTwoPi);
}

double SecondSensor::aside_rad(const Matrix3d& R_S2) const noexcept {
  const Matrix3d about_axis = so3_exp(rotation_rad(R_S2) * axis_S) * reference_S2;
  return so3_log(about_axis.transpose() * R_S2).norm();
}

}  // namespace perimap

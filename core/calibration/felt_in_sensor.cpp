#include "core/calibration/felt_in_sensor.hpp"

namespace perimap {

Eigen::Matrix<double, 6, 12> felt_in_sensor(const Pose& X_WS, const Vector3d& middle_W) {
  const Matrix3d R_SW = X_WS.R.transpose();
  Eigen::Matrix<double, 6, 12> felt = Eigen::Matrix<double, 6, 12>::Zero();
  felt.block<3, 3>(0, 0) = R_SW;
  felt.block<3, 3>(3, 0) = -R_SW * cross_matrix(X_WS.t - middle_W);
  felt.block<3, 3>(3, 3) = R_SW;
  felt.block<6, 6>(0, 6).setIdentity();
  return felt;
}

}  // namespace perimap

#include "core/calibration/rotation_spread.hpp"

#include <Eigen/Dense>

namespace perimap {

RotationSpread rotation_spread(const std::vector<Matrix3d>& rotations) {
  RotationSpread spread;
  if (rotations.empty()) return spread;
  const double n = static_cast<double>(rotations.size());
  Matrix3d mean = rotations.front();
  for (int round = 0; round < 10; ++round) {
    Vector3d turn = Vector3d::Zero();
    for (const Matrix3d& R : rotations) turn += so3_log(mean.transpose() * R) / n;
    mean = mean * so3_exp(turn);
  }
  Matrix3d scatter = Matrix3d::Zero();
  for (const Matrix3d& R : rotations) {
    const Vector3d w = so3_log(mean.transpose() * R);
    scatter += w * w.transpose() / n;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(scatter);
  spread.deviation_rad = eigen.eigenvalues().reverse().cwiseMax(0.0).cwiseSqrt();
  spread.axes = eigen.eigenvectors().rowwise().reverse();
  return spread;
}

}  // namespace perimap

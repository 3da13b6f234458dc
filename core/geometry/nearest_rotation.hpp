// The rotation that is nearest to a matrix.
#pragma once

#include <Eigen/SVD>

#include "core/geometry/pose.hpp"

namespace perimap {

// In the Frobenius norm (Kabsch, Acta Cryst. A32, 1976): of a sum of rotations their mean, of the sum of a_i b_i^T the
// rotation that takes all b_i nearest to a_i. Of a matrix of rank 1 or less any of many.
[[nodiscard]] inline Matrix3d nearest_rotation(const Matrix3d& M) noexcept {
  const Eigen::JacobiSVD<Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  return svd.matrixU() * Vector3d(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
}

}  // namespace perimap

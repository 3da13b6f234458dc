// Which rays through the projection centre meet a triangle, and where: the one formula by which images are rendered and
// ground truth is resolved.
#pragma once

#include <Eigen/LU>

#include "core/geometry/pose.hpp"

namespace perimap {

// With the corners as columns of M, a point on the ray r is z r = M (lambda_0, lambda_1, lambda_2), so w = M^-1 r has
// w_i = lambda_i / z: all of one sign inside, sum 1 / z, and the barycentric weights are w_i / sum(w).
struct TriangleRays {
  Matrix3d inverse;    // M^-1, 1/mm
  bool valid = false;  // false when the triangle is seen edge-on: no ray meets it in one point

  TriangleRays(const Vector3d& p_0, const Vector3d& p_1, const Vector3d& p_2) noexcept {
    Matrix3d M;
    M << p_0, p_1, p_2;
    double determinant = 0.0;
    M.computeInverseAndDetWithCheck(inverse, determinant, valid, 1e-9);
  }
};

}  // namespace perimap

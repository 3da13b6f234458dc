// A symmetric 3 x 3 matrix as its six elements xx xy xz yy yz zz, as covariances are kept and published.
#pragma once

#include <Eigen/Core>

#include "core/geometry/pose.hpp"

namespace perimap {

[[nodiscard]] inline Matrix3d from_six(const Eigen::Ref<const Eigen::Matrix<double, 6, 1>>& c) {
  Matrix3d m;
  m << c(0), c(1), c(2), c(1), c(3), c(4), c(2), c(4), c(5);
  return m;
}

[[nodiscard]] inline Eigen::Matrix<double, 6, 1> to_six(const Matrix3d& m) {
  Eigen::Matrix<double, 6, 1> c;
  c << m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2);
  return c;
}

}  // namespace perimap

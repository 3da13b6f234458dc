// The eigenvalues of symmetric 2x2 matrices (covariances, Hessians) in closed form.
#pragma once

#include <cmath>

#include "core/geometry/pose.hpp"

namespace perimap {

// Half the difference of the two.
[[nodiscard]] inline double eigenvalue_spread(const Matrix2d& C) noexcept {
  return std::hypot(0.5 * (C(0, 0) - C(1, 1)), 0.5 * (C(0, 1) + C(1, 0)));
}

[[nodiscard]] inline double larger_eigenvalue(const Matrix2d& C) noexcept {
  return 0.5 * C.trace() + eigenvalue_spread(C);
}

[[nodiscard]] inline double smaller_eigenvalue(const Matrix2d& C) noexcept {
  return 0.5 * C.trace() - eigenvalue_spread(C);
}

}  // namespace perimap

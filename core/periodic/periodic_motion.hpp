// Position and velocity from the coefficients of a periodic motion.
//
// State order (ours): for each axis x, y, z of frame W the coefficients of the basis, [DC, a_1..a_H, b_1..b_H, ...],
// mm. Paper order: [x_DC, y_DC, z_DC, f_x, f_y, f_z], where f is an axis without its DC (Tully, Kantor & Choset 2013).
#pragma once

#include <Eigen/Core>

#include "core/periodic/basis.hpp"

namespace perimap {

using StateVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxState, 1>;

// p_WF (mm) = (I_3 (x) b^T) x. x.size() == 3 * b.size().
[[nodiscard]] Eigen::Vector3d position_of(const StateVector& x, const Basis& b) noexcept;

// dp_WF/dt (mm/s) from the basis' rate (basis_rate) and dphi/dt in rad/s.
[[nodiscard]] Eigen::Vector3d velocity_of(const StateVector& x, const Basis& b_rate,
                                          double phase_rate_rad_per_s) noexcept;

// Where element i of our order stands in the paper's, for bases of n elements. 0 <= i < 3 n.
[[nodiscard]] constexpr int paper_index(int n, int i) noexcept {
  const int axis = i / n;
  const int j = i % n;
  return j == 0 ? axis : 3 + axis * (n - 1) + j - 1;
}

[[nodiscard]] StateVector to_paper_order(const StateVector& x) noexcept;
[[nodiscard]] StateVector from_paper_order(const StateVector& x_paper) noexcept;

}  // namespace perimap

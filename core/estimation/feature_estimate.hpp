// The filter's knowledge of one feature: coefficients of its periodic motion and their covariance. No heap.
#pragma once

#include <Eigen/Core>

#include "core/geometry/pose.hpp"
#include "core/periodic/basis.hpp"
#include "core/periodic/periodic_motion.hpp"

namespace perimap {

using StateMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxState, kMaxState>;
// P B^T (d x 3, mm^2): covariance of the state with the position at a phase.
using PositionGain = Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMaxState, 3>;

// B P B^T (3x3, mm^2, frame W): covariance of the position at the basis' phase. P is symmetric, 3 b.size() wide.
[[nodiscard]] Matrix3d position_covariance(const StateMatrix& P, const Basis& b) noexcept;
[[nodiscard]] PositionGain position_gain(const StateMatrix& P, const Basis& b) noexcept;

// Invariant: P is symmetric bit by bit and x and P are finite. Order of x and P: see periodic_motion.hpp. Basis vectors
// handed in must be x.size() / 3 long.
struct FeatureEstimate {
  StateVector x;  // mm
  StateMatrix P;  // mm^2

  // p_WF (mm) at the basis' phase.
  [[nodiscard]] Vector3d position(const Basis& b) const noexcept { return position_of(x, b); }
  [[nodiscard]] Matrix3d position_covariance(const Basis& b) const noexcept {
    return perimap::position_covariance(P, b);
  }
};

// Adds the variance of a random walk: independent steps of `deviation_mm` / k of both coefficients of harmonic k on
// each axis, k = 1 for the mean. For process noise (deviation = noise density * sqrt(time)) and for inflation.
void diffuse(FeatureEstimate& estimate, const BasisLayout& layout, double deviation_mm) noexcept;
// The variance that it adds to each coefficient of an axis, for a deviation of 1 (no unit), in the order of the basis.
[[nodiscard]] Basis diffusion_shape(const BasisLayout& layout) noexcept;

// The largest standard deviation of the position in any direction (mm) over `phases` equal steps of the cardiac cycle
// and, where the layout has respiration, as many of the respiratory one as its harmonics can tell apart; without
// `breath`, of the position that breathing displaces. The layout must be the estimate's.
[[nodiscard]] double largest_deviation_mm(const FeatureEstimate& estimate, const BasisLayout& layout, int phases = 16,
                                          bool breath = true) noexcept;

// Standard deviations before any measurement, independent and equal on the three axes: harmonic k of either series has
// deviation_k = harmonic_mm / k^decay for both of its coefficients. A steep decay makes many harmonics nearly free.
struct Prior {
  double dc_mm = 40.0;
  double cardiac_mm = 4.0;
  double respiratory_mm = 8.0;
  double decay = 2.0;
};

// The prior's deviation of each coefficient of one axis (mm), in the order of the basis.
[[nodiscard]] Basis prior_deviations(const BasisLayout& layout, const Prior& prior) noexcept;

// An unmoving feature at p_WF with the prior's covariance.
[[nodiscard]] FeatureEstimate prior_estimate(const BasisLayout& layout, const Prior& prior,
                                             const Vector3d& p_WF) noexcept;

}  // namespace perimap

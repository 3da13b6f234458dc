// What a feature's covariance must be enlarged by when the tracker's error is not white.
//
// The recursion takes the pose's error as new in each frame. Its estimate is then still the same weighted mean of what
// was seen, but an error that stays for seconds does not average out in it. To first order x^ - x = P sum_f A_f s_f
// with A_f = H_f^T R_f^-1 J_s,f (d x 6) and s_f the pose's error; for a Gauss-Markov error with E s_f s_g^T =
// rho^|f-g| Sigma the covariance is
//
//   P + P V P,   V = sum_{f != g} rho^|f-g| A_f Sigma A_g^T,
//
// the terms f = g being in R, and so in P, already. V is summed as the updates come. It is common to all features of
// the frames, so it does not make their relative positions uncertain; a subscriber of one feature must be told all the
// same. (The covariance of least squares under another noise than assumed: White, Econometrica 48, 1980.)
#pragma once

#include <Eigen/Core>

#include "core/estimation/feature_estimate.hpp"
#include "core/estimation/measurement_model.hpp"

namespace perimap {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix26d = Eigen::Matrix<double, 2, 6>;

class CorrelatedPoseNoise {
 public:
  // For a state of this size.
  explicit CorrelatedPoseNoise(Eigen::Index state_size);

  // One accepted update: basis, dz/dp_WF, the R it was given, J_s = dz/d[theta, c], the covariance of the pose's error
  // [theta (rad, C), c (mm, W)], and how much of the error is left since the update before (rho^frames, 0..1).
  void add(const Basis& b, const Matrix23d& dz_dp, const Matrix2d& R, const Matrix26d& J_s, const Matrix6d& sigma,
           double kept) noexcept;

  // P + P V P. Positive semidefinite as P is, to rounding.
  [[nodiscard]] StateMatrix enlarged(const StateMatrix& P) const noexcept;

 private:
  using Gain = Eigen::Matrix<double, Eigen::Dynamic, 6, 0, kMaxState, 6>;
  Gain recent_;  // sum over the earlier updates of rho^frames A
  StateMatrix V_;
};

}  // namespace perimap

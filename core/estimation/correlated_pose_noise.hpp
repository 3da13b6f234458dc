// What a feature's covariance must be enlarged by when the tracker's error is not white.
//
// The recursion takes the pose's error s as new in each frame. Its estimate is then still the same weighted mean of
// what was seen, but an error that stays for seconds does not average out in it. To first order an update leaves
//
//   e <- (I - K H) e + K J_s s      (e = x^ - x, K the gain, H = dz/dx, J_s = dz/ds),
//
// and where s is a Gauss-Markov process, E s_f s_g^T = exp(-|t_f - t_g| / tau) Sigma, the covariance of e is P + C. P,
// the recursion's own, has each s with itself, because R has; C has what the error of one frame and of another have in
// common, and is followed here together with X, E e s^T = X Sigma. It is common to all features of the frames, so it
// does not make their relative positions uncertain; a subscriber of one feature must be told all the same. (The
// covariance of least squares under another noise than assumed: White, Econometrica 48, 1980.)
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "core/estimation/feature_estimate.hpp"
#include "core/estimation/measurement_model.hpp"

namespace perimap {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix26d = Eigen::Matrix<double, 2, 6>;

// An observation that the estimate was made from.
struct PoseNoiseTerm {
  Basis b;
  PositionGain M;   // P B^T, P being that with this observation learnt
  Matrix23d dz_dp;  // at the position after learning
  Matrix2d R;       // that the observation was given, pose noise included
  Matrix26d dz_ds;  // with respect to the pose's error
  Matrix6d sigma;   // covariance of the pose's error, of the part that lasts alone: about the same at each
};

// No heap.
class CorrelatedPoseNoise {
 public:
  // correlation_s: time in which the pose's error falls to 1/e of what it was; 0: it is white, and C stays zero.
  CorrelatedPoseNoise(Eigen::Index state_size, double correlation_s) noexcept;

  // Of an estimate that nothing was learnt for.
  void reset() noexcept;

  // So much time has passed since the last term.
  void pass(double elapsed_s) noexcept { X_ *= correlation_s_ > 0.0 ? std::exp(-elapsed_s / correlation_s_) : 0.0; }

  // An update of the recursion, at once after it.
  void add(const PoseNoiseTerm& term) noexcept;
  // One of the observations of a batch solution, in order of time; M is of the solution's P for all of them. Ordered
  // before any add().
  void add_of_batch(const PoseNoiseTerm& term) noexcept;

  // C (mm^2). P + C is positive semidefinite, to rounding.
  [[nodiscard]] const StateMatrix& covariance() const noexcept { return C_; }
  // The positive semidefinite part of B C B^T (mm^2): what to add to B P B^T. Where the pose errors of different frames
  // cancel, C is negative; to first order only, so that is not relied on.
  [[nodiscard]] Matrix3d position_covariance(const Basis& b) const noexcept;

 private:
  using Gain = Eigen::Matrix<double, Eigen::Dynamic, 6, 0, kMaxState, 6>;
  double correlation_s_;
  StateMatrix C_;
  Gain X_;
};

}  // namespace perimap

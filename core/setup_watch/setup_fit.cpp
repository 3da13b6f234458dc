#include "core/setup_watch/setup_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/setup_watch/frame_equations.hpp"

namespace perimap {
namespace {

// The fewest that are worth a fit.
constexpr int kFewestFrames = 20;
constexpr int kFewestFeatures = 4;
// In deviations: an estimate that still moves by more is none.
constexpr double kLongestLastStep = 1.0;
// By errors so far apart it is judged how long they last; below this correlation they do not, and above the other one
// no window could tell.
constexpr double kCorrelationLag_s = 0.5;
constexpr double kLeastCorrelation = 0.15;
constexpr double kLargestCorrelation = 0.97;

using MatrixX10 = Eigen::Matrix<double, Eigen::Dynamic, kSetupNumbers>;

// The normal equations of the features' coefficients x and the set-up, without what is the frames' alone.
struct NormalEquations {
  Eigen::MatrixXd A_xx;
  MatrixX10 A_xd;
  SetupMatrix A_dd = SetupMatrix::Zero();
  Eigen::VectorXd g_x;
  SetupVector g_d = SetupVector::Zero();
};

class Fit {
 public:
  Fit(const WatchedWindow& window, const CameraModel& camera, const BasisLayout& layout,
      const SetupFitSettings& settings)
      : window_(window),
        camera_(camera),
        settings_(settings),
        n_(layout.size()),
        positions_(3 * static_cast<Eigen::Index>(window.features.size())),
        prior_deviations_(prior_deviations(layout, settings.motion)),
        prior_information_(settings.deviations.cwiseAbs2().cwiseInverse().asDiagonal()),
        x_(window.features),
        s_(window.frames.size(), FrameVector::Zero()) {}

  SetupFit run() {
    SetupFit fit;
    for (int i = 0; i < settings_.most_iterations; ++i) {
      const bool robust = i < settings_.robust_iterations;
      linearise(robust ? MatchWeighting::kStudent : MatchWeighting::kGate);
      fit.state = SetupFitState::kUnsolved;
      if (!solve()) return fit;
      if (!robust && length_of_step() < settings_.tolerance) break;
    }
    if (length_of_step() < kLongestLastStep) conclude(fit);
    return fit;
  }

 private:
  void linearise(MatchWeighting weighting) {
    frames_.clear();
    for (std::size_t f = 0; f < window_.frames.size(); ++f) {
      frames_.push_back(frame_equations(window_.frames[f], x_, camera_, deviation_, s_[f], weighting, settings_.gate));
    }
  }

  [[nodiscard]] NormalEquations normal_equations() const;
  void spread(const Eigen::MatrixXd& sums, Eigen::MatrixXd& A_xx) const;
  void settle_frames(const Eigen::VectorXd& step_x);
  [[nodiscard]] bool solve();
  // In the estimate's own deviations.
  [[nodiscard]] double length_of_step() const { return std::sqrt(step_.dot(information_ * step_)); }
  [[nodiscard]] MatrixX10 effective_jacobian(std::size_t f) const;
  void conclude(SetupFit& fit) const;
  [[nodiscard]] double seen_correlation_s() const;
  [[nodiscard]] SetupMatrix told_scatter(const std::vector<MatrixX10>& effective, double correlation_s) const;
  [[nodiscard]] SetupMatrix seen_scatter(const std::vector<MatrixX10>& effective) const;

  const WatchedWindow& window_;
  const CameraModel& camera_;
  const SetupFitSettings& settings_;
  Eigen::Index n_;          // of a basis
  Eigen::Index positions_;  // coordinates of all features
  Basis prior_deviations_;
  SetupMatrix prior_information_;

  std::vector<StateVector> x_;
  std::vector<FrameVector> s_;  // of each frame
  SetupVector deviation_ = SetupVector::Zero();
  std::vector<FrameEquations> frames_;
  // Of the last iteration.
  MatrixX10 Y_;              // A_xx^-1 A_xd: what the coefficients make of a change of the set-up, with its sign turned
  SetupMatrix information_;  // S with the prior's
  SetupVector step_;
};

// A frame adds N (x) b b^T, where N is the information about its features' positions: the sums over the frames of each
// of N's numbers times each of b b^T's are one product of two matrices.
NormalEquations Fit::normal_equations() const {
  const auto frames = static_cast<Eigen::Index>(frames_.size());
  const Eigen::Index pairs = positions_ * (positions_ + 1) / 2;
  const Eigen::Index products = n_ * (n_ + 1) / 2;
  Eigen::MatrixXd N_of_frames = Eigen::MatrixXd::Zero(pairs, frames);
  Eigen::MatrixXd bb_of_frames(frames, products);
  NormalEquations a;
  const Eigen::Index unknowns = positions_ * n_;
  a.A_xd = MatrixX10::Zero(unknowns, kSetupNumbers);
  a.g_x = Eigen::VectorXd::Zero(unknowns);
  Eigen::MatrixXd N(positions_, positions_);
  for (Eigen::Index f = 0; f < frames; ++f) {
    const FrameEquations& e = frames_[static_cast<std::size_t>(f)];
    const Basis& b = e.b;
    const Eigen::MatrixXd W_J_d = e.W * e.J_d;
    const Eigen::VectorXd W_r = e.W * e.r;
    a.A_dd += e.J_d.transpose() * W_J_d;
    a.g_d += e.J_d.transpose() * W_r;
    N.setZero();
    for (int i = 0; i < e.matches(); ++i) {
      const auto of_i = static_cast<std::size_t>(i);
      const Eigen::Index at_i = 3 * e.features[of_i];
      const Eigen::Matrix<double, 3, kSetupNumbers> N_pd = e.J_p[of_i].transpose() * W_J_d.middleRows<2>(2 * i);
      const Vector3d g_p = e.J_p[of_i].transpose() * W_r.segment<2>(2 * i);
      for (int axis = 0; axis < 3; ++axis) {
        a.A_xd.middleRows((at_i + axis) * n_, n_) += b * N_pd.row(axis);
        a.g_x.segment((at_i + axis) * n_, n_) += g_p(axis) * b;
      }
      for (int j = 0; j < e.matches(); ++j) {
        const auto of_j = static_cast<std::size_t>(j);
        N.block<3, 3>(at_i, 3 * e.features[of_j]) =
            e.J_p[of_i].transpose() * e.W.block<2, 2>(2 * i, 2 * j) * e.J_p[of_j];
      }
    }
    for (Eigen::Index q = 0, k = 0; q < positions_; k += q + 1, ++q)
      N_of_frames.col(f).segment(k, q + 1) = N.col(q).head(q + 1);
    for (Eigen::Index l = 0, k = 0; l < n_; k += l + 1, ++l)
      bb_of_frames.row(f).segment(k, l + 1) = b(l) * b.head(l + 1).transpose();
  }
  spread(N_of_frames * bb_of_frames, a.A_xx);
  // The prior of the motions: harmonics about zero, the mean about where the map has it.
  for (std::size_t i = 0; i < x_.size(); ++i) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      for (Eigen::Index m = 0; m < n_; ++m) {
        const Eigen::Index row = (3 * static_cast<Eigen::Index>(i) + axis) * n_ + m;
        const double information = 1.0 / (prior_deviations_(m) * prior_deviations_(m));
        const double about = m == 0 ? window_.features[i](axis * n_) : 0.0;
        a.A_xx(row, row) += information;
        a.g_x(row) -= information * (x_[i](axis * n_ + m) - about);
      }
    }
  }
  a.A_dd += prior_information_;
  a.g_d -= prior_information_ * deviation_;
  return a;
}

// sums(pair of coordinates, pair of the basis' numbers) into the lower triangle of A_xx, whose rows are coordinate by
// coordinate.
void Fit::spread(const Eigen::MatrixXd& sums, Eigen::MatrixXd& A_xx) const {
  A_xx.resize(positions_ * n_, positions_ * n_);
  for (Eigen::Index q = 0, pair = 0; q < positions_; ++q) {
    for (Eigen::Index p = 0; p <= q; ++p, ++pair) {
      for (Eigen::Index l = 0, k = 0; l < n_; ++l) {
        for (Eigen::Index m = 0; m <= l; ++m, ++k) {
          A_xx(q * n_ + l, p * n_ + m) = sums(pair, k);
          A_xx(q * n_ + m, p * n_ + l) = sums(pair, k);
        }
      }
    }
  }
}

bool Fit::solve() {
  NormalEquations a = normal_equations();
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> factor(a.A_xx);
  if (factor.info() != Eigen::Success) return false;
  Y_ = factor.solve(a.A_xd);
  information_ = a.A_dd - a.A_xd.transpose() * Y_;
  information_ = 0.5 * (information_ + SetupMatrix(information_.transpose()));
  const Eigen::LLT<SetupMatrix> reduced(information_);
  if (reduced.info() != Eigen::Success) return false;
  step_ = reduced.solve(a.g_d - Y_.transpose() * a.g_x);
  const Eigen::VectorXd step_x = factor.solve(a.g_x) - Y_ * step_;
  if (!step_.allFinite() || !step_x.allFinite()) return false;
  settle_frames(step_x);
  deviation_ += step_;
  for (std::size_t i = 0; i < x_.size(); ++i) x_[i] += step_x.segment(3 * static_cast<Eigen::Index>(i) * n_, 3 * n_);
  return true;
}

// Each frame's own error, given the step of all else.
void Fit::settle_frames(const Eigen::VectorXd& step_x) {
  for (std::size_t f = 0; f < frames_.size(); ++f) {
    const FrameEquations& e = frames_[f];
    Eigen::VectorXd rest = e.r - e.J_d * step_;
    for (int i = 0; i < e.matches(); ++i) {
      const auto of_i = static_cast<std::size_t>(i);
      Vector3d dp;
      for (int axis = 0; axis < 3; ++axis) dp(axis) = e.b.dot(step_x.segment((3 * e.features[of_i] + axis) * n_, n_));
      rest.segment<2>(2 * i) -= e.J_p[of_i] * dp;
    }
    s_[f] = e.gain * rest;
  }
}

// E: what a change of the set-up does to the frame's pixels that the motions do not take up.
MatrixX10 Fit::effective_jacobian(std::size_t f) const {
  const FrameEquations& e = frames_[f];
  MatrixX10 E = e.J_d;
  for (int i = 0; i < e.matches(); ++i) {
    const auto of_i = static_cast<std::size_t>(i);
    Eigen::Matrix<double, 3, kSetupNumbers> taken_up;
    for (int axis = 0; axis < 3; ++axis) {
      taken_up.row(axis) = e.b.transpose() * Y_.middleRows((3 * e.features[of_i] + axis) * n_, n_);
    }
    E.middleRows<2>(2 * i) -= e.J_p[of_i] * taken_up;
  }
  return E;
}

// How long the tracker's errors last by those that the frames were found to have; 0 where they do not. (What of them is
// slow is partly taken up by the set-up and the motions: it is rather too short than too long.)
double Fit::seen_correlation_s() const {
  double alike = 0.0, all = 0.0, apart_s = 0.0, pairs = 0.0;
  std::size_t later = 0;
  for (std::size_t f = 0; f < s_.size(); ++f) {
    while (later < s_.size() && window_.frames[later].t_s - window_.frames[f].t_s < kCorrelationLag_s) ++later;
    if (later == s_.size()) break;
    const Eigen::Matrix<double, 6, 1> deviations = prior_variances(window_.frames[f]).head<6>().cwiseSqrt();
    const Eigen::Matrix<double, 6, 1> one = s_[f].head<6>().cwiseQuotient(deviations);
    const Eigen::Matrix<double, 6, 1> other = s_[later].head<6>().cwiseQuotient(deviations);
    alike += one.dot(other);
    all += 0.5 * (one.squaredNorm() + other.squaredNorm());
    apart_s += window_.frames[later].t_s - window_.frames[f].t_s;
    pairs += 1.0;
  }
  if (!(alike > kLeastCorrelation * all)) return 0.0;
  return -apart_s / pairs / std::log(std::min(alike / all, kLargestCorrelation));
}

// The covariance of sum_f E_f^T W_f r_f under the errors that were told, which may last.
SetupMatrix Fit::told_scatter(const std::vector<MatrixX10>& effective, double correlation_s) const {
  SetupMatrix scatter = SetupMatrix::Zero();
  std::vector<Eigen::Matrix<double, kSetupNumbers, kFrameUnknowns>> by_frame;
  for (std::size_t f = 0; f < frames_.size(); ++f) {
    const FrameEquations& e = frames_[f];
    const MatrixX10 W_E = e.W * effective[f];
    for (int i = 0; i < e.matches(); ++i) {
      const Eigen::Matrix<double, 2, kSetupNumbers> of_match = W_E.middleRows<2>(2 * i);
      scatter += of_match.transpose() * e.R[static_cast<std::size_t>(i)] * of_match;
    }
    const FrameVector deviations = prior_variances(window_.frames[f]).cwiseSqrt();
    by_frame.emplace_back(W_E.transpose() * e.J_s * deviations.asDiagonal());
    scatter += by_frame.back() * by_frame.back().transpose();
  }
  if (!(correlation_s > 0.0)) return scatter;
  // Of the pose; the error of the phase is another one in each cycle.
  for (std::size_t f = 0; f < frames_.size(); ++f) {
    for (std::size_t g = 0; g < f; ++g) {
      const double apart_s = std::abs(window_.frames[f].t_s - window_.frames[g].t_s);
      const SetupMatrix common =
          std::exp(-apart_s / correlation_s) * by_frame[f].leftCols<6>() * by_frame[g].leftCols<6>().transpose();
      scatter += common + common.transpose();
    }
  }
  return scatter;
}

// The same as the residuals have it, weighed down with the time between frames (Bartlett).
SetupMatrix Fit::seen_scatter(const std::vector<MatrixX10>& effective) const {
  std::vector<SetupVector> influence;
  for (std::size_t f = 0; f < frames_.size(); ++f) {
    influence.emplace_back(effective[f].transpose() * (frames_[f].W * frames_[f].r));
  }
  SetupMatrix scatter = SetupMatrix::Zero();
  for (std::size_t f = 0; f < frames_.size(); ++f) {
    for (std::size_t g = 0; g < frames_.size(); ++g) {
      const double apart = std::abs(window_.frames[f].t_s - window_.frames[g].t_s) / settings_.alike_s;
      if (apart < 1.0) scatter += (1.0 - apart) * influence[f] * influence[g].transpose();
    }
  }
  return scatter;
}

void Fit::conclude(SetupFit& fit) const {
  std::vector<MatrixX10> effective;
  double chi2 = 0.0;
  double used_up = kSetupNumbers;
  for (std::size_t f = 0; f < frames_.size(); ++f) {
    effective.push_back(effective_jacobian(f));
    const FrameEquations& e = frames_[f];
    chi2 += e.r.dot(e.W * e.r);
    fit.matches += e.matches();
    fit.frames += e.matches() > 0 ? 1 : 0;
  }
  used_up += static_cast<double>(positions_ * n_);
  const SetupMatrix inverse = information_.llt().solve(SetupMatrix::Identity());
  fit.error_correlation_s = std::max(window_.error_correlation_s, seen_correlation_s());
  const SetupMatrix told = told_scatter(effective, fit.error_correlation_s);
  const SetupMatrix bounded = told + prior_information_;
  const SetupMatrix seen = seen_scatter(effective) + prior_information_;
  fit.scatter = std::max(1.0, (bounded.llt().solve(seen)).trace() / kSetupNumbers);
  fit.deviation = deviation_;
  fit.covariance = inverse * (fit.scatter * told + prior_information_) * inverse;
  fit.covariance = 0.5 * (fit.covariance + SetupMatrix(fit.covariance.transpose()));
  fit.chi2_with = chi2;
  fit.chi2_without = chi2 + deviation_.dot((information_ - prior_information_) * deviation_);
  fit.freedom = std::max(1.0, 2.0 * fit.matches - used_up);
  for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(x_.size()); ++i) {
    auto& shift = fit.shift.emplace_back();
    for (int axis = 0; axis < 3; ++axis) shift.row(axis) = -Y_.row((3 * i + axis) * n_);
  }
  const bool explained = fit.chi2_with < settings_.largest_chi2 * fit.freedom;
  if (explained && fit.covariance.allFinite()) fit.state = SetupFitState::kSolved;
}

// Root mean square of the camera's centre about its mean, beyond the tracker's noise.
double camera_spread_mm(const WatchedWindow& window) {
  Vector3d mean = Vector3d::Zero();
  for (const WatchedFrame& frame : window.frames) mean += frame.X_WC.t;
  mean /= static_cast<double>(window.frames.size());
  double spread = 0.0;
  for (const WatchedFrame& frame : window.frames) {
    spread += (frame.X_WC.t - mean).squaredNorm() - 3.0 * frame.position_variance_mm2 -
              2.0 * frame.rotation_variance_rad2 * frame.lever_W_mm.squaredNorm();
  }
  return std::sqrt(std::max(0.0, spread / static_cast<double>(window.frames.size())));
}

}  // namespace

SetupFit fit_setup(const WatchedWindow& window, const CameraModel& camera, const BasisLayout& layout,
                   const SetupFitSettings& settings) {
  const bool enough = window.frames.size() >= kFewestFrames && window.features.size() >= kFewestFeatures;
  SetupFit fit;
  if (!enough) return fit;
  fit.state = SetupFitState::kStill;
  if (camera_spread_mm(window) < settings.least_spread_mm) return fit;
  return Fit(window, camera, layout, settings).run();
}

}  // namespace perimap

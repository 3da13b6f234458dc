#include "core/estimation/common_displacement.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

// A single frame counts for no more than one that is so many of its deviations off: where most of the matches have been
// misled together it is far off, and alone.
constexpr double kLargest_deviations = 5.0;
// Nothing is displaced by much more: what the frames do not tell stays near zero.
constexpr double kTurnDeviation_rad = 0.2;
constexpr double kShiftDeviation_mm = 50.0;
// A window's mean is told by so many frames, that are there for this share of it.
constexpr std::uint64_t kFewestFrames = 5;
constexpr double kLeastShare = 0.6;

// The information with what is known beforehand.
Matrix6d with_prior(const Matrix6d& W) noexcept {
  Matrix6d all = W;
  all.diagonal().head<3>().array() += 1.0 / (kTurnDeviation_rad * kTurnDeviation_rad);
  all.diagonal().tail<3>().array() += 1.0 / (kShiftDeviation_mm * kShiftDeviation_mm);
  return all;
}

// Variance of a mean of n errors over that of white ones, each rho times like the one before.
double variance_of_mean(std::uint64_t n, double rho) noexcept {
  double sum = 1.0;
  double power = 1.0;
  for (std::uint64_t k = 1; k < n; ++k) {
    power *= rho;
    if (power < 1e-6) break;
    sum += 2.0 * (1.0 - static_cast<double>(k) / static_cast<double>(n)) * power;
  }
  return sum;
}

}  // namespace

DisplacementEvidence displacement_evidence(const Vector6d& s, const Matrix6d& posterior, const Matrix6d& searched,
                                           const Matrix6d& tracker, const Pose& X_WC,
                                           const Vector3d& pivot_W_mm) noexcept {
  const Matrix6d identity = Matrix6d::Identity();
  const Matrix6d P_inverse = posterior.llt().solve(identity);
  const Matrix6d tracker_inverse = tracker.llt().solve(identity);
  // Of the matches alone.
  const Matrix6d Lambda = P_inverse - Matrix6d(searched.llt().solve(identity));
  const Matrix6d A = tracker_inverse * Matrix6d((Lambda + tracker_inverse).llt().solve(identity));
  Matrix6d T;
  T << X_WC.R.transpose(), Matrix3d::Zero(), cross_matrix(X_WC.t - pivot_W_mm), -Matrix3d::Identity();
  DisplacementEvidence evidence;
  evidence.g = T.transpose() * (A * (P_inverse * s));
  const Matrix6d W = T.transpose() * (A * Lambda) * T;
  evidence.W = 0.5 * (W + W.transpose());
  return evidence;
}

Pose displaced(const Vector6d& d, const Vector3d& pivot_W_mm) noexcept {
  const Matrix3d R = so3_exp(d.head<3>());
  return {R, pivot_W_mm + d.tail<3>() - R * pivot_W_mm};
}

Matrix6d map_covariance(const DisplacedSurface& surface) noexcept {
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal().head<3>().setConstant(surface.map_variance_mm2 / (surface.spread_mm * surface.spread_mm));
  covariance.diagonal().tail<3>().setConstant(surface.map_variance_mm2);
  return covariance;
}

DisplacementSize size_of(const Vector6d& d, const Matrix6d& covariance, const DisplacedSurface& surface) noexcept {
  const Matrix6d all = covariance + map_covariance(surface);
  // A turn moves a feature by its distance from the axis.
  const double turned_mm2 = surface.spread_mm * surface.spread_mm * 2.0 / 3.0;
  return {std::sqrt(d.tail<3>().squaredNorm() + turned_mm2 * d.head<3>().squaredNorm()),
          std::sqrt(all.diagonal().tail<3>().sum() + turned_mm2 * all.diagonal().head<3>().sum()),
          d.dot(all.llt().solve(d))};
}

void CommonDisplacement::add(Instant capture, const DisplacementEvidence& evidence) noexcept {
  if (!evidence.g.allFinite() || !evidence.W.allFinite()) return;
  if (count_ > 0 && capture - entry(count_ - 1).capture < kEvery) return;
  Entry& added = entries_[count_++ % kCapacity];
  added = {capture, evidence};
  const double chi2 = evidence.g.dot(with_prior(evidence.W).llt().solve(evidence.g));
  const double weight = std::min(1.0, kLargest_deviations / std::sqrt(std::max(chi2, 1e-12)));
  added.evidence.g *= weight;
  added.evidence.W *= weight;
}

MeanDisplacement CommonDisplacement::mean(std::size_t window, Instant now,
                                          const DisplacedSurface& surface) const noexcept {
  MeanDisplacement mean;
  DisplacementEvidence sum;
  std::uint64_t n = 0;
  Instant first = now;
  Instant last = now;
  for (; n < std::min(count_, kCapacity); ++n) {
    const Entry& added = entry(count_ - 1 - n);
    if (now - added.capture > kWindows[window]) break;
    sum.g += added.evidence.g;
    sum.W += added.evidence.W;
    first = added.capture;
    if (n == 0) last = added.capture;
  }
  if (n < kFewestFrames || to_seconds(last - first) < kLeastShare * to_seconds(kWindows[window])) return mean;
  const double correlation_s = to_seconds(error_correlation_);
  const double every_s = to_seconds(last - first) / static_cast<double>(n - 1);
  const double rho = correlation_s > 0.0 ? std::exp(-every_s / correlation_s) : 0.0;
  Matrix6d covariance = with_prior(sum.W).llt().solve(Matrix6d::Identity());
  mean.d = covariance * sum.g;
  covariance *= variance_of_mean(n, rho);
  // Of the surface that is seen, which may be far from the pivot: a turn moves it by its lever.
  Matrix6d to_centre = Matrix6d::Identity();
  to_centre.bottomLeftCorner<3, 3>() = -cross_matrix(surface.centre_mm);
  mean.at_centre = to_centre * mean.d;
  mean.covariance = to_centre * covariance * to_centre.transpose();
  static_cast<DisplacementSize&>(mean) = size_of(mean.at_centre, mean.covariance, surface);
  mean.told = std::isfinite(mean.chi2) && std::isfinite(mean.size_mm);
  return mean;
}

}  // namespace perimap

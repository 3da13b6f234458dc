#include "core/pipeline/image_phase.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "core/pipeline/pose_noise.hpp"

namespace perimap {
namespace {

constexpr int kPasses = 2;
// What is looked for lies within some tens of milliseconds; wide enough not to matter where the image can tell.
constexpr double kPriorDeviation_s = 0.1;
// A patch that follows a little late or slides does so on all features alike.
constexpr double kCommonDeviation_s = 1.5e-3;
constexpr double kLargestDeviation_s = 0.03;
constexpr double kLargestShift_s = 0.15;

}  // namespace

CommonInformation pose_prior(const CameraPose& pose) noexcept {
  // The sensor turns by theta_W about itself and moves by d: the camera turns by -R_CW theta_W in its own frame and its
  // centre moves by theta_W x lever + d.
  Matrix6d A = Matrix6d::Zero();
  A.topLeftCorner<3, 3>() = -pose.X_WC.R.transpose();
  A.bottomLeftCorner<3, 3>() = -cross_matrix(pose.lever_W_mm);
  A.bottomRightCorner<3, 3>().setIdentity();
  const Matrix6d covariance = A * pose_error_covariance(pose) * A.transpose();
  CommonInformation prior = CommonInformation::zero(kPoseUnknowns);
  const Matrix6d Lambda = covariance.llt().solve(Matrix6d::Identity());
  prior.Lambda = 0.5 * (Lambda + Lambda.transpose());
  return prior;
}

ImagePhaseOutcome ImagePhase::observe(std::span<FeatureGroup> groups, const FrameRecord& frame, const PixelModel& model,
                                      const EstimatorSettings& settings, ObservedPhase& observed) noexcept {
  if (!frame.measurable || groups.empty()) return ImagePhaseOutcome::kCanNotTell;
  constexpr double kPriorVariance_s2 = kPriorDeviation_s * kPriorDeviation_s;
  constexpr Eigen::Index kShift = kPoseUnknowns;  // the appended unknown, s
  CommonInformation prior = with_appended(pose_prior(frame.pose), kPriorVariance_s2);
  const std::size_t stride = (groups.size() + kMostGroups - 1) / kMostGroups;
  double shift_s = 0.0;
  double variance_s2 = 0.0;
  for (int pass = 0; pass < kPasses; ++pass) {
    matches_.clear();
    const double phase_rad = frame.phase.phase_rad + shift_s * frame.phase.rate_rad_per_s;
    SweepPhase<double> at;
    at.set(basis_at(settings.layout, phase_rad), basis_rate(settings.layout, phase_rad), frame.phase.rate_rad_per_s,
           0.0);
    for (std::size_t g = frame.index % stride; g < groups.size(); g += stride) {
      groups[g].collect(at, settings.pixel_deviation_px, matches_);
    }
    if (matches_.size() < static_cast<std::size_t>(kFewestMatches)) return ImagePhaseOutcome::kCanNotTell;
    used_.assign(matches_.size(), 0);
    prior.eta(kShift) = -shift_s / kPriorVariance_s2;
    const SharedPose shared =
        estimate_shared_pose(model, frame.X_CW, prior, std::span<const CommonMatch>(matches_), std::span(used_));
    if (!shared.estimate.ok) return ImagePhaseOutcome::kCanNotTell;
    if (2 * static_cast<std::size_t>(shared.used) < matches_.size()) return ImagePhaseOutcome::kContradicts;
    if (shared.used < kFewestMatches) return ImagePhaseOutcome::kCanNotTell;
    shift_s += shared.estimate.s(kShift);
    variance_s2 = shared.estimate.covariance(kShift, kShift);
    if (!(std::abs(shift_s) < kLargestShift_s)) return ImagePhaseOutcome::kContradicts;
  }
  // Without what the prior said.
  const double precision = 1.0 / variance_s2 - 1.0 / kPriorVariance_s2;
  if (!(precision > 1.0 / (kLargestDeviation_s * kLargestDeviation_s))) return ImagePhaseOutcome::kCanNotTell;
  shift_s /= variance_s2 * precision;
  const double rate = frame.phase.rate_rad_per_s;
  observed = {frame.stamp.capture, frame.phase.phase_rad + rate * shift_s,
              rate * std::sqrt(1.0 / precision + kCommonDeviation_s * kCommonDeviation_s)};
  return ImagePhaseOutcome::kObserved;
}

}  // namespace perimap

#include "core/pipeline/image_phase.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/pipeline/feature_stages.hpp"
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
// The same for breathing, of which the phase is looked for within this.
constexpr double kBreathPriorDeviation_rad = 0.5;
constexpr double kLargestBreathShift = 2.0;  // prior deviations
// Of what a feature's covariance says, so much is common to all that were learnt from the same poses: by far the most
// of it is the features' own. Errors of the tracker that last are told beside it, and common.
constexpr double kCommonShare = 0.1;
// Breathing displaces the heart by up to 2 cm.
constexpr double kDisplacementDeviation_mm = 15.0;

}  // namespace

Matrix6d camera_error_covariance(const CameraPose& pose) noexcept {
  // The sensor turns by theta_W about itself and moves by d: the camera turns by -R_CW theta_W in its own frame and its
  // centre moves by theta_W x lever + d.
  Matrix6d A = Matrix6d::Zero();
  A.topLeftCorner<3, 3>() = -pose.X_WC.R.transpose();
  A.bottomLeftCorner<3, 3>() = -cross_matrix(pose.lever_W_mm);
  A.bottomRightCorner<3, 3>().setIdentity();
  return A * pose_error_covariance(pose) * A.transpose();
}

CommonInformation pose_prior(const CameraPose& pose) noexcept {
  const Matrix6d covariance = camera_error_covariance(pose);
  CommonInformation prior = CommonInformation::zero(kPoseUnknowns);
  const Matrix6d Lambda = covariance.llt().solve(Matrix6d::Identity());
  prior.Lambda = 0.5 * (Lambda + Lambda.transpose());
  return prior;
}

void ImagePhase::collect(std::span<FeatureGroup> groups, const FrameRecord& frame, const EstimatorSettings& settings,
                         const Shifts& shifts, Asked asked) noexcept {
  const BasisLayout& layout = settings.layout;
  const double phase_rad = frame.phase.phase_rad + shifts.cardiac * frame.phase.rate_rad_per_s;
  RespiratoryPhase respiration = frame.respiration;
  respiration.phase_rad += shifts.breath * respiration.rate_rad_per_s;
  const Basis b = basis_at(layout, phase_rad, respiration);
  SweepPhase<double> at;
  at.set(b, basis_rate(layout, phase_rad), frame.phase.rate_rad_per_s, 0.0);
  SweepPhase<double> breath;
  if (respiration.known) breath.set(b, breath_rate(layout, respiration.phase_rad), respiration.rate_rad_per_s, 0.0);
  matches_.clear();
  owners_.clear();
  const std::size_t stride = (groups.size() + kMostGroups - 1) / kMostGroups;
  for (std::size_t g = frame.index % stride; g < groups.size(); g += stride) {
    groups[g].collect(at, respiration.known ? &breath : nullptr, asked, settings.pixel_deviation_px, frame.picture,
                      matches_, owners_);
  }
  used_.assign(matches_.size(), 0);
}

ImagePhases ImagePhase::observe(std::span<FeatureGroup> groups, const FrameRecord& frame, const PixelModel& model,
                                const EstimatorSettings& settings) noexcept {
  agreed_ = CommonEstimate();
  observed_ = {};
  const ImagePhases can_not_tell;
  const ImagePhases contradicts{{ImagePhaseOutcome::kContradicts, {}}, {ImagePhaseOutcome::kContradicts, {}}};
  if (!frame.measurable || groups.empty()) return can_not_tell;
  // The appended unknowns: shift of the cardiac phase and of the respiratory one, s.
  constexpr Eigen::Index kShift = kPoseUnknowns;
  constexpr Eigen::Index kBreathShift = kPoseUnknowns + 1;
  constexpr double kPriorVariance_s2 = kPriorDeviation_s * kPriorDeviation_s;
  const double breath_deviation_s =
      frame.respiration.known ? kBreathPriorDeviation_rad / frame.respiration.rate_rad_per_s : 0.0;
  const double breath_prior_s2 = breath_deviation_s * breath_deviation_s;
  CommonInformation prior = with_appended(pose_prior(frame.pose), kPriorVariance_s2);
  if (frame.respiration.known) prior = with_appended(prior, breath_prior_s2);
  collect(groups, frame, settings, {}, Asked::kConverged);
  const bool converged = matches_.size() >= static_cast<std::size_t>(kFewestMatches);
  const ImagePhases nothing_near = converged ? contradicts : can_not_tell;
  double shift_s = 0.0;
  double breath_shift_s = 0.0;
  CommonEstimate solved;
  Shifts solved_at;
  for (int pass = 0; pass < kPasses; ++pass) {
    solved_at = {shift_s, breath_shift_s};
    collect(groups, frame, settings, solved_at, converged ? Asked::kConverged : Asked::kMapped);
    if (matches_.size() < static_cast<std::size_t>(kFewestMatches)) return can_not_tell;
    prior.eta(kShift) = -shift_s / kPriorVariance_s2;
    if (frame.respiration.known) prior.eta(kBreathShift) = -breath_shift_s / breath_prior_s2;
    const SharedPose shared =
        estimate_shared_pose(model, frame.X_CW, prior, std::span<const CommonMatch>(matches_), std::span(used_));
    if (!shared.estimate.ok) return can_not_tell;
    if (2 * static_cast<std::size_t>(shared.used) < matches_.size()) return nothing_near;
    if (shared.used < kFewestMatches) return can_not_tell;
    solved = shared.estimate;
    shift_s += solved.s(kShift);
    if (frame.respiration.known) breath_shift_s += solved.s(kBreathShift);
    if (!(std::abs(shift_s) < kLargestShift_s)) return nothing_near;
    if (!(std::abs(breath_shift_s) <= kLargestBreathShift * breath_deviation_s)) return nothing_near;
  }
  if (converged) {
    observed_ = {shift_s, breath_shift_s};
    agreed_ = solved;
    refuse_what_disagrees(groups, frame, model, settings, solved_at, solved);
  }
  // Frames that follow each other faster than usual err alike (see match_covariance): together they tell no more.
  const double alike = std::max(1.0, 1.0 / frame.rate.of_usual());
  const auto answer = [&](Eigen::Index unknown, double found_s, double prior_s2, double phase_rad,
                          double rate_rad_per_s, double largest_deviation_s, double common_deviation_s) {
    ImagePhaseAnswer result;
    // Without what the prior said.
    const double variance_s2 = solved.covariance(unknown, unknown);
    const double precision = 1.0 / variance_s2 - 1.0 / prior_s2;
    if (!(precision > 1.0 / (largest_deviation_s * largest_deviation_s))) return result;
    result.outcome = converged ? ImagePhaseOutcome::kObserved : ImagePhaseOutcome::kTentative;
    result.observed = {frame.stamp.capture, phase_rad + rate_rad_per_s * found_s / (variance_s2 * precision),
                       rate_rad_per_s * std::sqrt(alike * (1.0 / precision + common_deviation_s * common_deviation_s))};
    return result;
  };
  ImagePhases phases;
  phases.cardiac = answer(kShift, shift_s, kPriorVariance_s2, frame.phase.phase_rad, frame.phase.rate_rad_per_s,
                          kLargestDeviation_s, kCommonDeviation_s);
  if (frame.respiration.known) {
    phases.respiratory = answer(kBreathShift, breath_shift_s, breath_prior_s2, frame.respiration.phase_rad,
                                frame.respiration.rate_rad_per_s, breath_deviation_s, kCommonDeviation_s);
  }
  return phases;
}

void ImagePhase::refuse_what_disagrees(std::span<FeatureGroup> groups, const FrameRecord& frame,
                                       const PixelModel& model, const EstimatorSettings& settings, const Shifts& shifts,
                                       const CommonEstimate& solved) noexcept {
  for (std::size_t first = 0; first < groups.size(); first += kMostGroups) {
    collect(groups.subspan(first, std::min(kMostGroups, groups.size() - first)), frame, settings, shifts,
            Asked::kMapped);
    for (std::size_t k = 0; k < matches_.size(); ++k) {
      const CommonTerm term = linearise(model, solved, matches_[k]);
      FeatureSlot& slot = *owners_[k];
      // A camera that moves by as much the other way sees the same.
      slot.beside = {term.visible,  frame.index,      term.r,       -term.J_s.middleCols<3>(3),
                     matches_[k].R, matches_[k].p_WF, matches_[k].S};
      // What is known to be displaced is followed where it is.
      if (slot.pressed && term.visible) continue;
      if (!term.visible || term.squared_residual > settings.update.gate) refuse_match(slot, frame);
    }
  }
}

ImagePhase::Together ImagePhase::together(std::span<FeatureGroup> groups, const FrameRecord& frame,
                                          const CameraPose& searched, const PixelModel& model,
                                          const EstimatorSettings& settings) noexcept {
  Together told;
  if (!frame.measurable || groups.empty()) return told;
  collect(groups, frame, settings, observed_, Asked::kWellKnown);
  if (matches_.size() < static_cast<std::size_t>(kFewestMatches)) return told;
  // The phases are those observed; what the frame's matches say of them beside is no displacement.
  CommonInformation prior = with_appended(pose_prior(searched), kPriorDeviation_s * kPriorDeviation_s);
  prior.eta(kPoseUnknowns) = -observed_.cardiac / (kPriorDeviation_s * kPriorDeviation_s);
  if (frame.respiration.known) {
    const double breath_deviation_s = kBreathPriorDeviation_rad / frame.respiration.rate_rad_per_s;
    prior = with_appended(prior, breath_deviation_s * breath_deviation_s);
    prior.eta(kPoseUnknowns) = -observed_.cardiac / (kPriorDeviation_s * kPriorDeviation_s);
    prior.eta(kPoseUnknowns + 1) = -observed_.breath / (breath_deviation_s * breath_deviation_s);
  }
  const SharedPose shared =
      estimate_shared_pose(model, frame.X_CW, prior, std::span<const CommonMatch>(matches_), std::span(used_));
  const bool most = 2 * static_cast<std::size_t>(shared.used) >= matches_.size();
  if (!shared.estimate.ok || shared.used < kFewestMatches || !most) return told;
  told.told = true;
  told.estimate = shared.estimate;
  const auto n = static_cast<double>(matches_.size());
  for (std::size_t k = 0; k < matches_.size(); ++k) {
    told.centre_W_mm += matches_[k].p_WF / n;
    Matrix3d common = kCommonShare * matches_[k].S;
    if (const auto& slow_error = owners_[k]->slow_error) common += slow_error->position_covariance(frame.b);
    told.map_variance_mm2 += common.trace() / (3.0 * n);
  }
  double spread_mm2 = 0.0;
  for (const CommonMatch& match : matches_) spread_mm2 += (match.p_WF - told.centre_W_mm).squaredNorm() / n;
  told.spread_mm = std::sqrt(spread_mm2);
  return told;
}

bool ImagePhase::displacement(std::span<FeatureGroup> groups, const FrameRecord& frame, const PixelModel& model,
                              const EstimatorSettings& settings, Vector3d& displacement_mm) noexcept {
  if (!frame.measurable || groups.empty()) return false;
  CameraPose pose = frame.pose;
  pose.position_variance_mm2 += kDisplacementDeviation_mm * kDisplacementDeviation_mm;
  collect(groups, frame, settings, {}, Asked::kMapped);
  // The features' own motions are not asked.
  for (CommonMatch& match : matches_) match.D.resize(3, 0);
  if (matches_.size() < static_cast<std::size_t>(kFewestMatches)) return false;
  const SharedPose shared = estimate_shared_pose(model, frame.X_CW, pose_prior(pose),
                                                 std::span<const CommonMatch>(matches_), std::span(used_));
  if (!shared.estimate.ok || shared.used < kFewestMatches) return false;
  // The camera stands where the surface would have to stand the other way.
  displacement_mm = -shared.estimate.s.segment<3>(3);
  return true;
}

}  // namespace perimap

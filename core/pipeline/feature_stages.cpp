#include "core/pipeline/feature_stages.hpp"

#include <algorithm>

#include "core/pipeline/pose_noise.hpp"

namespace perimap {
namespace {

// Image motion changes by about this much from frame to frame where no map predicts it (systole begins at up to
// 25 px/frame at 640x480 and 30 frames/s).
constexpr double kUnmappedMotionDeviation_px = 10.0;

struct PixelPrediction {
  bool valid = false;
  Vector2d px = Vector2d::Zero();
  Matrix2d covariance_px2 = Matrix2d::Identity();
};

PixelPrediction predict_from_map(const MapPrediction& map, const FrameRecord& frame, const PixelModel& model) noexcept {
  if (!map.valid || !frame.measurable) return {};
  PixelPrediction prediction;
  Matrix23d J_C;
  const Vector3d p_WF = map.p_WF + frame.displacement_mm;
  if (model.camera.project(frame.X_CW * p_WF, prediction.px, &J_C) != ProjectionStatus::kOk) return {};
  const Matrix23d J_p = J_C * frame.X_CW.R;
  // One pixel more on each axis: what the model does not know about the tissue.
  CameraPose pose = frame.pose;
  pose.position_variance_mm2 =
      frame.tracker_variance_mm2 + frame.displacement_deviation_mm * frame.displacement_deviation_mm;
  prediction.covariance_px2 =
      J_p * map.covariance_W * J_p.transpose() + pose_noise_covariance(pose, p_WF, J_p) + Matrix2d::Identity();
  prediction.valid = prediction.covariance_px2.allFinite();
  return prediction;
}

PixelPrediction predict_from_image(const FeatureSlot& slot, const FrameRecord& frame) noexcept {
  const std::uint64_t frames = frame.index - slot.last_found_frame;
  if (frames > kTrackedMissesAllowed) return {};
  const auto n = static_cast<double>(frames);
  PixelPrediction prediction;
  prediction.valid = true;
  // A velocity that is older than a frame misleads more than it helps: the motion turns within a few frames.
  prediction.px = frames == 1 ? Vector2d(slot.patch_state.px + slot.velocity_px) : slot.patch_state.px;
  const double deviation = kUnmappedMotionDeviation_px * n;
  prediction.covariance_px2 = deviation * deviation * Matrix2d::Identity();
  return prediction;
}

// Whether this may be a look-alike: there is room for one in the search region, and the feature was not there in the
// frame before, or not found about where it was expected.
bool is_doubtful(const PixelPrediction& prediction, const Vector2d& px, std::uint64_t frames) noexcept {
  constexpr double kNarrow_px = 3;
  if (prediction.covariance_px2.trace() <= 2 * kNarrow_px * kNarrow_px) return false;
  return frames > 1 || (px - prediction.px).norm() > kUnmappedMotionDeviation_px;
}

// Whether the match can be the feature, as far as the map and the causal phase tell. What is learnt from it is judged
// again when its phase is known.
bool agrees(const PatchMatch& match, const PixelPrediction& from_map, double gate) noexcept {
  const Vector2d r = match.px - from_map.px;
  const Matrix2d C = from_map.covariance_px2 + match.covariance_px2;
  return r.dot(C.inverse() * r) <= gate;
}

// Longer than a heart's beat, which stretches the picture of its surface and lets it go again.
constexpr int kStaleBeforeRenewal = 60;

// The view has turned so far, and for so long, that the template fits badly: a fresh one at the place just found. Each
// renewal moves the followed point by about the match's deviation, which no later match makes up for. Where none can be
// made there the old one stays.
void renew_stale_template(FeatureSlot& slot, const FrameJob& job) noexcept {
  slot.stale_matches = template_is_stale(slot.patch_state) ? slot.stale_matches + 1 : 0;
  if (slot.stale_matches < kStaleBeforeRenewal) return;
  slot.stale_matches = 0;
  PatchTemplate renewed;
  if (make_patch_template(job.image, slot.match.px, TemplateSettings{}, job.tracker->kernels(), renewed) !=
      TemplateVerdict::kGood) {
    return;
  }
  slot.patch = renewed;
  slot.looks.reset();
  slot.patch_state = PatchState{};
  slot.patch_state.px = slot.match.px;
}

}  // namespace

void predict_and_find(FeatureSlot& slot, const MapPrediction& map, const FrameJob& job, const PixelModel& model,
                      const PipelineSettings& settings) noexcept {
  slot.match = PatchMatch{};
  slot.match_agrees = false;
  if (slot.state == SlotState::kEmpty) return;
  const PixelPrediction from_map = predict_from_map(map, *job.frame, model);
  const PixelPrediction from_image = predict_from_image(slot, *job.frame);
  const bool use_map =
      from_map.valid && (!from_image.valid || from_map.covariance_px2.trace() < from_image.covariance_px2.trace());
  const PixelPrediction& prediction = use_map ? from_map : from_image;
  if (!prediction.valid || !settings.camera.contains(prediction.px)) return;
  const Vector2d last_px = slot.patch_state.px;
  PatchState seen = slot.patch_state;
  slot.match = job.tracker->track(job.image, slot.patch, seen, prediction.px, prediction.covariance_px2);
  if (slot.match.state != MatchState::kFound) return;
  const std::uint64_t frames = job.frame->index - slot.last_found_frame;
  if (is_doubtful(prediction, slot.match.px, frames) &&
      !slot.looks.is_plausible(slot.patch_state, seen, slot.match.correlation, frames)) {
    slot.match.state = MatchState::kLowCorrelation;
    return;
  }
  slot.patch_state = seen;
  slot.looks.add(slot.match.correlation);
  slot.match_agrees = from_map.valid && agrees(slot.match, from_map, settings.estimator.update.gate);
  const bool in_a_row = slot.last_found_frame + 1 == job.frame->index;
  renew_stale_template(slot, job);
  slot.velocity_px = in_a_row ? Vector2d(slot.match.px - last_px) : Vector2d::Zero();
  slot.last_found_frame = job.frame->index;
}

void refuse_match(FeatureSlot& slot, const FrameRecord& frame) noexcept {
  slot.match.state = MatchState::kTooFar;
  slot.match_agrees = false;
  ++slot.refused_in_a_row;
  slot.last_found_frame = frame.index - std::min<std::uint64_t>(frame.index, kTrackedMissesAllowed + 1);
}

void describe(const FeatureSlot& slot, FeatureSnapshot& snapshot) noexcept {
  snapshot.id = slot.id;
  snapshot.last_observed = slot.last_observed;
  snapshot.first_observed = slot.first_observed;
  snapshot.first_observed_px = slot.first_observed_px;
  snapshot.largest_deviation_mm = slot.largest_deviation_mm;
  if (slot.health.state() == HealthState::kInconsistent) {
    snapshot.state = FeatureState::kInconsistent;
    snapshot.reason = FeatureReason::kInnovationsHigh;
  } else if (!slot.converged) {
    snapshot.state = FeatureState::kConverging;
    snapshot.reason = FeatureReason::kDeviationLarge;
  } else {
    snapshot.state = FeatureState::kConverged;
    snapshot.reason = slot.match_agrees ? FeatureReason::kNone : FeatureReason::kNotObserved;
  }
}

void hold_match(FeatureSlot& slot, const FrameJob& job) noexcept {
  if (slot.state == SlotState::kEmpty || slot.match.state != MatchState::kFound || !job.frame->measurable) return;
  slot.held.push({job.frame->index, slot.match.px, slot.match.covariance_px2});
  if (slot.match_agrees) slot.last_observed = job.frame->stamp.capture;
}

}  // namespace perimap

#include "core/pipeline/feature_stages.hpp"

#include <algorithm>
#include <cmath>

#include "core/periodic/periodic_motion.hpp"
#include "core/pipeline/pose_noise.hpp"

namespace perimap {
namespace {

// Image motion changes by about this much from frame to frame where no map predicts it (systole begins at up to
// 25 px/frame at 640x480 and 30 frames/s).
constexpr double kUnmappedMotionDeviation_px = 10.0;
constexpr int kTrackedMissesAllowed = 5;
constexpr int kRefusalsBeforeRelock = 10;
constexpr int kRefusalsBeforeLost = 90;
constexpr std::uint64_t kUnobservedFramesBeforeLost = 900;
constexpr int kFailedStartsBeforeLost = 3;
constexpr std::uint64_t kConvergenceCheckFrames = 15;
constexpr double kInflation_mm = 1.0;
constexpr int kUpdatesBeforeConverged = 30;  // beyond the start, so that the innovation statistic means something

struct PixelPrediction {
  bool valid = false;
  Vector2d px = Vector2d::Zero();
  Matrix2d covariance_px2 = Matrix2d::Identity();
};

PixelPrediction predict_from_map(const FeatureSlot& slot, const FrameRecord& frame, const PixelModel& model) noexcept {
  if (slot.state != SlotState::kMapped || !frame.measurable) return {};
  const Vector3d p_WF = position_of(slot.estimate.x, frame.b);
  const Vector3d velocity = velocity_of(slot.estimate.x, frame.b_rate, frame.phase.rate_rad_per_s);
  PixelPrediction prediction;
  Matrix23d J_C;
  if (model.camera.project(frame.X_CW * p_WF, prediction.px, &J_C) != ProjectionStatus::kOk) return {};
  const Matrix23d J_p = J_C * frame.X_CW.R;
  const Vector3d phase_spread = velocity * frame.phase.deviation_s;
  const Matrix3d P_W = slot.estimate.position_covariance(frame.b) + phase_spread * phase_spread.transpose();
  // One pixel more on each axis: what the model does not know about the tissue.
  prediction.covariance_px2 =
      J_p * P_W * J_p.transpose() + pose_noise_covariance(frame.pose, p_WF, J_p) + Matrix2d::Identity();
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

Matrix2d measurement_covariance(const HeldMatch& held, const FrameRecord& frame, const Vector3d& p_WF,
                                const Matrix23d& J_p, double pixel_deviation_px) noexcept {
  return held.covariance_px2 + pixel_deviation_px * pixel_deviation_px * Matrix2d::Identity() +
         pose_noise_covariance(frame.pose, p_WF, J_p);
}

// Fills slot.start from the first held matches. False when one of them can not be used (its frame has left the history
// or has no phase any more, or its pixel has no ray); the held matches up to it are then dropped.
bool prepare_start(FeatureSlot& slot, const FrameJob& job, const PixelModel& model,
                   const EstimatorSettings& settings) noexcept {
  const auto& depths = settings.batch.start_depths_mm;
  const double depth_mm = depths[depths.size() / 2];  // only scales the pose noise; the start finds the true depth
  slot.start.count = 0;
  for (int i = 0; i < settings.start_observations; ++i) {
    const auto k = static_cast<std::uint32_t>(i);
    const HeldMatch& held = slot.held[k];
    const FrameRecord* frame = job.history->find(held.frame_index);
    Vector3d ray_C;
    Vector2d px;
    Matrix23d J_C;
    // A frame can lose its phase after its match was held, when the next beat shows that the cycle was none.
    if (frame == nullptr || !frame->measurable || !model.camera.unproject(held.px, ray_C) ||
        model.camera.project(depth_mm * ray_C, px, &J_C) != ProjectionStatus::kOk) {
      slot.held.drop(k + 1);
      return false;
    }
    Observation& observation = slot.start.observations[k];
    observation.z = held.px;
    observation.X_CW = frame->X_CW;
    observation.b = frame->b;
    observation.R = measurement_covariance(held, *frame, frame->pose.X_WC * (depth_mm * ray_C), J_C * frame->X_CW.R,
                                           settings.pixel_deviation_px);
    ++slot.start.count;
  }
  return true;
}

void check_convergence(FeatureSlot& slot, const EstimatorSettings& settings) noexcept {
  slot.largest_deviation_mm = largest_deviation_mm(slot.estimate, settings.layout);
  slot.converged = slot.largest_deviation_mm <= settings.converged_deviation_mm &&
                   slot.updates >= kUpdatesBeforeConverged && slot.health.monitor().consistent();
}

// The view has turned so far that the first template fits badly: a fresh one at the place just found. Where none can be
// made there the old one stays.
void renew_template(FeatureSlot& slot, const ImagePyramid& pyramid) noexcept {
  PatchTemplate renewed;
  if (make_patch_template(pyramid, slot.match.px, TemplateSettings{}, renewed) != TemplateVerdict::kGood) return;
  slot.patch = renewed;
  slot.patch_state = PatchState{};
  slot.patch_state.px = slot.match.px;
}

LearnOutcome give_up(FeatureSlot& slot) noexcept {
  slot.state = SlotState::kEmpty;
  return LearnOutcome::kLost;
}

// The estimate explains nothing any more: gather the observations of a new start. The feature keeps its patch and its
// id.
LearnOutcome start_anew(FeatureSlot& slot) noexcept {
  slot.state = SlotState::kTracked;
  slot.held.clear();
  slot.failed_starts = 0;
  slot.converged = false;
  return LearnOutcome::kStartedAnew;
}

LearnOutcome learn_tracked(FeatureSlot& slot, const FrameJob& job, const PixelModel& model,
                           const PipelineSettings& settings) noexcept {
  const std::uint64_t now = job.frame->index;
  if (now - slot.last_found_frame > kTrackedMissesAllowed) return give_up(slot);
  while (slot.held.size() > 0 && job.history->find(slot.held[0].frame_index) == nullptr) slot.held.drop(1);
  if (slot.held.size() < static_cast<std::uint32_t>(settings.estimator.start_observations)) {
    return LearnOutcome::kNothing;
  }
  if (!prepare_start(slot, job, model, settings.estimator)) return LearnOutcome::kNothing;
  slot.start.adopt_at_frame = now + static_cast<std::uint64_t>(settings.adoption_delay_frames);
  // Relaxed: housekeeping touches the flag only after it has popped this slot's request, and the ring orders that.
  slot.start.ready.store(false, std::memory_order_relaxed);
  slot.state = SlotState::kStarting;
  return LearnOutcome::kStartRequested;
}

LearnOutcome adopt_start(FeatureSlot& slot, const FrameJob& job, const PipelineSettings& settings) noexcept {
  const std::uint64_t now = job.frame->index;
  if (now < slot.start.adopt_at_frame) return LearnOutcome::kNothing;
  // Acquire: pairs with housekeeping's release store, so that the whole outcome is visible.
  if (!slot.start.ready.load(std::memory_order_acquire)) {
    return now == slot.start.adopt_at_frame ? LearnOutcome::kAdoptionLate : LearnOutcome::kNothing;
  }
  const auto used = static_cast<std::uint32_t>(slot.start.count);
  if (!slot.start.outcome.ok()) {
    if (++slot.failed_starts >= kFailedStartsBeforeLost) return give_up(slot);
    slot.held.drop(used / 2);
    slot.state = SlotState::kTracked;
    return LearnOutcome::kNothing;
  }
  if (const FrameRecord* last = job.history->find(slot.held[used - 1].frame_index)) {
    slot.last_observed = last->stamp.capture;
  }
  slot.held.drop(used);
  slot.estimate = slot.start.outcome.estimate;
  slot.last_learnt = slot.last_observed;
  slot.health.reset();
  slot.updates = 0;
  slot.refused_in_a_row = 0;
  slot.state = SlotState::kMapped;
  check_convergence(slot, settings.estimator);
  return LearnOutcome::kNothing;
}

void apply(FeatureSlot& slot, const HeldMatch& held, const FrameRecord& frame, const PixelModel& model,
           const EstimatorSettings& settings) noexcept {
  const Vector3d p_WF = position_of(slot.estimate.x, frame.b);
  Vector2d predicted_px;
  Matrix23d J_C;
  if (model.camera.project(frame.X_CW * p_WF, predicted_px, &J_C) != ProjectionStatus::kOk) {
    ++slot.refused_in_a_row;
    return;
  }
  const Matrix23d J_p = J_C * frame.X_CW.R;
  // The phase's deviation is noise along the motion: J v v^T J^T sigma_t^2.
  const Vector3d velocity = velocity_of(slot.estimate.x, frame.b_rate, frame.phase.rate_rad_per_s);
  const Vector2d phase_spread = J_p * velocity * frame.phase.deviation_s;
  Observation observation;
  observation.z = held.px;
  observation.X_CW = frame.X_CW;
  observation.b = frame.b;
  observation.R = measurement_covariance(held, frame, p_WF, J_p, settings.pixel_deviation_px) +
                  phase_spread * phase_spread.transpose();
  if (slot.health.process_noise() > 0.0 && frame.stamp.capture > slot.last_learnt) {
    const double elapsed_s = to_seconds(frame.stamp.capture - slot.last_learnt);
    diffuse(slot.estimate, settings.layout, slot.health.process_noise() * std::sqrt(elapsed_s));
  }
  slot.last_learnt = frame.stamp.capture;
  const UpdateOutcome outcome = iterated_update(slot.estimate, observation, model, settings.update);
  const HealthAction action = slot.health.add(outcome.normalised_innovation_squared, outcome.accepted);
  if (action == HealthAction::kInflate) diffuse(slot.estimate, settings.layout, kInflation_mm);
  if (!outcome.accepted) {
    ++slot.refused_in_a_row;
    return;
  }
  slot.refused_in_a_row = 0;
  ++slot.updates;
  slot.last_observed = frame.stamp.capture;
}

LearnOutcome learn_mapped(FeatureSlot& slot, const FrameJob& job, const PixelModel& model,
                          const PipelineSettings& settings) noexcept {
  const int refused_before = slot.refused_in_a_row;
  for (int i = 0; i < kLearnPerFrame && slot.held.size() > 0; ++i) {
    const HeldMatch held = slot.held[0];
    slot.held.drop(1);
    const FrameRecord* frame = job.history->find(held.frame_index);
    if (frame != nullptr && frame->measurable) apply(slot, held, *frame, model, settings.estimator);
  }
  const std::uint64_t now = job.frame->index;
  if (slot.refused_in_a_row >= kRefusalsBeforeLost || now - slot.last_found_frame > kUnobservedFramesBeforeLost) {
    return give_up(slot);
  }
  if (refused_before / kRefusalsBeforeRelock < slot.refused_in_a_row / kRefusalsBeforeRelock) {
    // The patch follows something else: let go of it, so that the next search starts where the map says.
    slot.last_found_frame =
        std::min(slot.last_found_frame, now - std::min<std::uint64_t>(now, kTrackedMissesAllowed + 1));
  }
  // Spread over the frames by id, so that no frame pays for all features.
  if ((now + slot.id) % kConvergenceCheckFrames == 0) check_convergence(slot, settings.estimator);
  if (slot.health.state() == HealthState::kFailed) return start_anew(slot);
  if (slot.health.state() == HealthState::kInconsistent) slot.converged = false;
  return LearnOutcome::kNothing;
}

}  // namespace

void predict_and_find(FeatureSlot& slot, const FrameJob& job, const PixelModel& model,
                      const PipelineSettings& settings) noexcept {
  slot.match = PatchMatch{};
  if (slot.state == SlotState::kEmpty) return;
  const PixelPrediction from_map = predict_from_map(slot, *job.frame, model);
  const PixelPrediction from_image = predict_from_image(slot, *job.frame);
  const bool use_map =
      from_map.valid && (!from_image.valid || from_map.covariance_px2.trace() < from_image.covariance_px2.trace());
  const PixelPrediction& prediction = use_map ? from_map : from_image;
  if (!prediction.valid || !settings.camera.contains(prediction.px)) return;
  const Vector2d last_px = slot.patch_state.px;
  slot.match = track(*job.pyramid, slot.patch, slot.patch_state, prediction.px, prediction.covariance_px2);
  if (slot.match.state != MatchState::kFound) return;
  const bool in_a_row = slot.last_found_frame + 1 == job.frame->index;
  if (template_is_stale(slot.patch_state)) renew_template(slot, *job.pyramid);
  slot.velocity_px = in_a_row ? Vector2d(slot.match.px - last_px) : Vector2d::Zero();
  slot.last_found_frame = job.frame->index;
}

bool evaluate(const FeatureSlot& slot, const FrameJob& job, FeatureSnapshot& snapshot) noexcept {
  if (slot.state != SlotState::kMapped) return false;
  snapshot.id = slot.id;
  snapshot.x = slot.estimate.x;
  for (std::size_t i = 0; i < job.releases.size(); ++i) {
    snapshot.covariances_W_mm2[i] = slot.estimate.position_covariance(job.releases[i].b);
  }
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
    const bool observed = slot.match.state == MatchState::kFound && job.frame->measurable && slot.refused_in_a_row == 0;
    snapshot.reason = observed ? FeatureReason::kNone : FeatureReason::kNotObserved;
  }
  return true;
}

void hold_match(FeatureSlot& slot, const FrameJob& job) noexcept {
  if (slot.state == SlotState::kEmpty || slot.match.state != MatchState::kFound || !job.frame->measurable) return;
  slot.held.push({job.frame->index, slot.match.px, slot.match.covariance_px2});
}

LearnOutcome learn(FeatureSlot& slot, const FrameJob& job, const PixelModel& model,
                   const PipelineSettings& settings) noexcept {
  switch (slot.state) {
    case SlotState::kEmpty:
      return LearnOutcome::kNothing;
    case SlotState::kTracked:
      return learn_tracked(slot, job, model, settings);
    case SlotState::kStarting:
      return adopt_start(slot, job, settings);
    case SlotState::kMapped:
      return learn_mapped(slot, job, model, settings);
  }
  return LearnOutcome::kNothing;
}

}  // namespace perimap

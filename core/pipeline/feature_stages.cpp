#include "core/pipeline/feature_stages.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/geometry/symmetric_matrix2.hpp"
#include "core/pipeline/pose_noise.hpp"
#include "core/pipeline/sight.hpp"

namespace perimap {
namespace {

// Image motion changes by about this much from frame to frame where no map predicts it (systole begins at up to
// 750 px/s at 640x480).
constexpr double kUnmappedMotion_px_per_s = 300.0;

struct PixelPrediction {
  bool valid = false;
  double pose_deviation_px = 0.0;  // largest, of the part that is not the map's
  Vector2d px = Vector2d::Zero();
  Matrix2d covariance_px2 = Matrix2d::Identity();
};

// One pixel more on each axis: what the model does not know about the tissue.
Matrix2d of_the_model() noexcept { return Matrix2d::Identity(); }

PixelPrediction predict_from_map(const MapPrediction& map, const FrameRecord& frame, const PixelModel& model,
                                 const CommonShift& shift = {}) noexcept {
  if (!map.valid || !frame.measurable) return {};
  PixelPrediction prediction;
  Matrix23d J_C;
  const Vector3d p_WF = map.p_WF + frame.displacement_mm;
  if (model.camera.project(frame.X_CW * p_WF, prediction.px, &J_C) != ProjectionStatus::kOk) return {};
  const Matrix23d J_p = J_C * frame.X_CW.R;
  Matrix2d of_pose;
  if (shift.known) {
    // It has the errors of pose and displacement, and its deviation what the model does not know.
    of_pose = shift.variance_at(prediction.px) * Matrix2d::Identity();
    prediction.px += shift.at(prediction.px);
  } else {
    CameraPose pose = frame.pose;
    pose.position_variance_mm2 =
        frame.tracker_variance_mm2 + frame.displacement_deviation_mm * frame.displacement_deviation_mm;
    of_pose = pose_noise_covariance(pose, p_WF, J_p) + of_the_model();
  }
  prediction.covariance_px2 = J_p * map.covariance_W * J_p.transpose() + of_pose;
  prediction.pose_deviation_px = std::sqrt(larger_eigenvalue(of_pose));
  prediction.valid = prediction.covariance_px2.allFinite();
  return prediction;
}

// From the pose that the frame's matches agree on: far narrower than the tracker's where that is noisy.
PixelPrediction predict_from_shared_pose(const MapPrediction& map, const CommonEstimate& shared,
                                         const PixelModel& model) noexcept {
  PixelPrediction prediction;
  MeasurementJacobians J;
  if (measure(model, shared.X_CW, map.p_WF, prediction.px, &J) != ProjectionStatus::kOk) return {};
  CommonJacobian J_s(2, kPoseUnknowns);
  J_s << J.dz_dtheta, J.dz_dc;
  prediction.covariance_px2 = J.dz_dp * map.covariance_W * J.dz_dp.transpose() +
                              common_noise(J_s, shared.covariance.topLeftCorner(kPoseUnknowns, kPoseUnknowns)) +
                              of_the_model();
  prediction.valid = prediction.covariance_px2.allFinite();
  return prediction;
}

double unmapped_motion_px(const FrameJob& job) noexcept { return kUnmappedMotion_px_per_s / job.frame->rate.per_s(); }

std::uint64_t frames_since_found(const FeatureSlot& slot, const FrameJob& job) noexcept {
  return job.frame->index - slot.last_found_frame;
}

// By its own motion, while it is fresh: an older velocity misleads more than it helps, the motion turns within a few
// frames.
PixelPrediction predict_from_velocity(const FeatureSlot& slot, const FrameJob& job) noexcept {
  PixelPrediction prediction;
  prediction.valid = frames_since_found(slot, job) == 1;
  prediction.px = slot.patch_state.px + slot.velocity_px;
  const double deviation_px = unmapped_motion_px(job);
  prediction.covariance_px2 = deviation_px * deviation_px * Matrix2d::Identity();
  return prediction;
}

// From where it was found last some frames ago, whatever has moved since.
PixelPrediction predict_from_last_place(const FeatureSlot& slot, const FrameJob& job) noexcept {
  const std::uint64_t frames = frames_since_found(slot, job);
  PixelPrediction prediction;
  prediction.valid = frames > 1 && frames <= job.frame->rate.frames(kTrackedUnseen);
  prediction.px = slot.patch_state.px;
  const double deviation_px = unmapped_motion_px(job) * static_cast<double>(frames);
  prediction.covariance_px2 = deviation_px * deviation_px * Matrix2d::Identity();
  return prediction;
}

// Where the features around it say that it has moved to; each frame since it was found has added to the doubt.
PixelPrediction predict_from_neighbours(const FeatureSlot& slot, const NeighbourMotion::Around& neighbours,
                                        const FrameJob& job) noexcept {
  constexpr double kStrain_px = 1.5, kDoubt_px_per_s = 15.0;
  const std::uint64_t frames = frames_since_found(slot, job);
  PixelPrediction prediction;
  prediction.valid = neighbours.known && frames <= job.frame->rate.frames(kCarriedUnseen);
  prediction.px = slot.carried_px + neighbours.by;
  const double deviation_px = kStrain_px + neighbours.disagreement_px +
                              kDoubt_px_per_s / job.frame->rate.per_s() * static_cast<double>(frames - 1);
  prediction.covariance_px2 = deviation_px * deviation_px * Matrix2d::Identity();
  return prediction;
}

const PixelPrediction& surer(const PixelPrediction& a, const PixelPrediction& b) noexcept {
  if (!a.valid || !b.valid) return a.valid ? a : b;
  return a.covariance_px2.trace() < b.covariance_px2.trace() ? a : b;
}

// Whether this may be a look-alike: there is room for one in the search region, and the feature was not there in the
// frame before, or not found about where it was expected.
bool is_doubtful(const PixelPrediction& prediction, const Vector2d& px, std::uint64_t frames,
                 double unmapped_motion_px) noexcept {
  constexpr double kNarrow_px = 3;
  if (prediction.covariance_px2.trace() <= 2 * kNarrow_px * kNarrow_px) return false;
  return frames > 1 || (px - prediction.px).norm() > unmapped_motion_px;
}

// Whether the match can be the feature, as far as the prediction tells. What is learnt from it is judged again when its
// phase is known.
bool agrees(const PatchMatch& match, const PixelPrediction& prediction, double gate) noexcept {
  const Vector2d r = match.px - prediction.px;
  const Matrix2d C = prediction.covariance_px2 + match.covariance_px2;
  return r.dot(C.inverse() * r) <= gate;
}

// Blur, smoke or a weak texture have left so little that the place is hardly told; as one of many alike (see
// match_covariance) it would count for nothing, and it leads the next searches astray.
bool is_vague(const PatchMatch& match) noexcept {
  constexpr double kLargestDeviation_px = 1.0;
  return !(larger_eigenvalue(match.covariance_px2) <= kLargestDeviation_px * kLargestDeviation_px);
}

// Longer than a heart's beat, which stretches the picture of its surface and lets it go again.
constexpr Duration kStaleBeforeRenewal = std::chrono::seconds(2);

// The view has turned so far, and for so long, that the template fits badly: a fresh one at the place just found. Each
// renewal moves the followed point by about the match's deviation, which no later match makes up for. Where none can be
// made there the old one stays.
void renew_stale_template(FeatureSlot& slot, const FrameJob& job) noexcept {
  slot.stale_matches = template_is_stale(slot.patch_state) ? slot.stale_matches + 1 : 0;
  if (slot.stale_matches < job.frame->rate.frames(kStaleBeforeRenewal)) return;
  slot.stale_matches = 0;
  PatchTemplate renewed;
  if (make_patch_template(job.image, slot.match.px, job.templates, job.tracker->kernels(), renewed) !=
      TemplateVerdict::kGood) {
    return;
  }
  slot.patch = renewed;
  slot.looks.reset();
  slot.patch_state = PatchState{};
  slot.patch_state.px = slot.match.px;
}

// Whether a match may be believed without looking like the feature.
enum class Looks : std::uint8_t { kAskedInDoubt, kAskedAlways };

void seek(FeatureSlot& slot, const PixelPrediction& prediction, Looks looks, const FrameJob& job,
          const PipelineSettings& settings) noexcept {
  slot.match = PatchMatch{};
  if (!prediction.valid || !settings.camera.contains(prediction.px)) return;
  slot.seen = slot.patch_state;
  slot.match = job.tracker->track(job.image, slot.patch, slot.seen, prediction.px, prediction.covariance_px2);
  if (slot.match.state != MatchState::kFound) return;
  const std::uint64_t frames = frames_since_found(slot, job);
  const bool is_asked =
      looks == Looks::kAskedAlways || is_doubtful(prediction, slot.match.px, frames, unmapped_motion_px(job));
  const double usual_frames = static_cast<double>(frames) * job.frame->rate.of_usual();
  const bool is_other =
      is_asked && !slot.looks.is_plausible(slot.patch_state, slot.seen, slot.match.correlation, usual_frames);
  if (is_other || is_vague(slot.match)) slot.match.state = MatchState::kLowCorrelation;
}

// What was found is believed: the next search builds on it.
void believe(FeatureSlot& slot, const FrameJob& job) noexcept {
  slot.velocity_px =
      frames_since_found(slot, job) == 1 ? Vector2d(slot.match.px - slot.patch_state.px) : Vector2d::Zero();
  slot.patch_state = slot.seen;
  slot.carried_px = slot.match.px;
  slot.looks.add(slot.match.correlation);
  renew_stale_template(slot, job);
  slot.last_found_frame = job.frame->index;
}

// A jump that what is around it did not make. What the map knows well needs no neighbours: the frame's other matches
// have judged it.
bool moves_otherwise(const FeatureSlot& slot, const PixelPrediction& from_neighbours, double gate) noexcept {
  if (slot.converged || !from_neighbours.valid) return false;
  return !agrees(slot.match, from_neighbours, gate);
}

}  // namespace

void predict_and_find(FeatureSlot& slot, const MapPrediction& map, const FrameJob& job, const PixelModel& model,
                      const PipelineSettings& settings) noexcept {
  slot.match = PatchMatch{};
  slot.match_agrees = false;
  if (slot.state == SlotState::kEmpty) return;
  const PixelPrediction from_map = predict_from_map(map, *job.frame, model);
  if (map.valid && job.frame->measurable) slot.in_view = from_map.valid && settings.camera.contains(from_map.px);
  if (slot.shed) return;
  const PixelPrediction wide = surer(from_map, predict_from_velocity(slot, job));
  Looks looks = Looks::kAskedInDoubt;
  if (job.shift.known && from_map.valid) {
    const PixelPrediction near = predict_from_map(map, *job.frame, model, job.shift);
    if (near.valid && near.covariance_px2.trace() < wide.covariance_px2.trace()) {
      seek(slot, near, looks, job, settings);
      looks = Looks::kAskedAlways;  // what is found where the others are not
    }
  }
  if (slot.match.state != MatchState::kFound) seek(slot, wide, looks, job, settings);
  if (slot.match.state != MatchState::kFound) return;
  slot.match_agrees = from_map.valid && agrees(slot.match, from_map, settings.estimator.update.gate);
  slot.off_px = slot.match.px - from_map.px;
  slot.pose_deviation_px = from_map.pose_deviation_px;
}

void settle_match(FeatureSlot& slot, const MapPrediction& map, const FrameJob& job, const PixelModel& model,
                  const PipelineSettings& settings) noexcept {
  if (slot.state == SlotState::kEmpty || slot.shed) return;
  const double gate = settings.estimator.update.gate;
  const NeighbourMotion::Around neighbours = job.motion->around(slot.carried_px, &slot.patch_state.px);
  const PixelPrediction from_neighbours = predict_from_neighbours(slot, neighbours, job);
  if (slot.match.state != MatchState::kFound || moves_otherwise(slot, from_neighbours, gate)) {
    const bool pose_is_shared = map.valid && job.shared_pose != nullptr;
    const PixelPrediction from_map = pose_is_shared ? predict_from_shared_pose(map, *job.shared_pose, model)
                                                    : predict_from_map(map, *job.frame, model);
    slot.match_agrees = false;
    seek(slot, surer(from_map, from_neighbours.valid ? from_neighbours : predict_from_last_place(slot, job)),
         Looks::kAskedAlways, job, settings);
    if (slot.match.state == MatchState::kFound) {
      slot.match_agrees = from_map.valid && agrees(slot.match, from_map, gate);
    }
  }
  if (slot.match.state == MatchState::kFound) {
    believe(slot, job);
  } else {
    slot.carried_px += neighbours.by;
  }
}

void let_go(FeatureSlot& slot, const FrameRecord& frame) noexcept {
  if (frame.index - slot.last_found_frame < kFramesLongAgo) slot.last_found_frame = frame.index - kFramesLongAgo;
}

void refuse_match(FeatureSlot& slot, const FrameRecord& frame) noexcept {
  slot.match.state = MatchState::kTooFar;
  slot.match_agrees = false;
  ++slot.refused_in_a_row;
  let_go(slot, frame);
}

void describe(const FeatureSlot& slot, Instant now, FeatureSnapshot& snapshot) noexcept {
  snapshot.id = slot.id;
  snapshot.last_observed = slot.last_observed;
  snapshot.expected = slot.in_view && !slot.shed;
  snapshot.in_sight = slot.match_agrees || now - slot.last_observed <= Sight::kLately;
  snapshot.first_observed = slot.first_observed;
  snapshot.first_observed_px = slot.first_observed_px;
  snapshot.largest_deviation_mm = slot.largest_deviation_mm;
  if (slot.health.state() == HealthState::kInconsistent) {
    snapshot.state = FeatureState::kInconsistent;
    snapshot.reason = FeatureReason::kInnovationsHigh;
    return;
  }
  snapshot.state = is_called_converged(slot, now) ? FeatureState::kConverged : FeatureState::kConverging;
  if (slot.shed) {
    snapshot.reason = FeatureReason::kShed;
  } else if (!slot.converged) {
    snapshot.reason = FeatureReason::kDeviationLarge;
  } else {
    snapshot.reason = slot.match_agrees ? FeatureReason::kNone : FeatureReason::kNotObserved;
  }
}

bool is_called_converged(const FeatureSlot& slot, Instant now) noexcept {
  if (!slot.converged || slot.health.state() == HealthState::kInconsistent) return false;
  return slot.match_agrees || now - slot.last_observed <= kBelievedUnseen;
}

namespace {

bool is_wanted_for_start(const FeatureSlot& slot, const FrameJob& job) noexcept {
  if (slot.held.size() == 0) return true;
  const FrameRecord* last = job.history->find(slot.held[slot.held.size() - 1].frame_index);
  if (last == nullptr) return true;
  return job.frame->held_number - last->held_number >= job.frame->held_rate.frames(kStartMatchesEvery);
}

}  // namespace

void hold_match(FeatureSlot& slot, const FrameJob& job) noexcept {
  if (slot.state == SlotState::kEmpty || slot.match.state != MatchState::kFound || !job.frame->measurable) return;
  if (job.frame->held && (slot.state != SlotState::kTracked || is_wanted_for_start(slot, job))) {
    slot.held.push({job.frame->index, slot.match.px, slot.match.covariance_px2});
  }
  if (slot.match_agrees) slot.last_observed = job.frame->stamp.capture;
}

}  // namespace perimap

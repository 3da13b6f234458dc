#include "core/pipeline/feature_stages.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/geometry/symmetric_matrix2.hpp"
#include "core/pipeline/sight.hpp"

namespace perimap {
namespace {

// For so long a feature is still sought as it looked last.
constexpr Duration kLastViewKept = std::chrono::seconds(2);

// A first view that fits less well is held against the last one.
constexpr double kSureCorrelation = 0.95;
// Whether the two have found the same place: chi-squared, 99 %, with what either may slide by where light moves.
constexpr double kSamePlaceGate = 9.21;
constexpr double kSlide_px = 0.5;

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

// The place is hardly told: blur, smoke or a weak texture have left so little, or a last view has drifted so far. As
// one of many alike (see match_covariance) it would count for nothing: it is not learnt from.
bool is_vague(const PatchMatch& match) noexcept {
  constexpr double kLargestDeviation_px = 1.0;
  return !(larger_eigenvalue(match.covariance_px2) <= kLargestDeviation_px * kLargestDeviation_px);
}

// What a map may learn from. The looser a match, the further its errors reach beyond what it claims: of those that
// claim up to 0.3 px three in ten thousand are off by more than 3 px, of those that claim 0.5 one in eighty, of those
// that claim 0.9 one in eight (docs/decisions/0180), and a map that has learnt them goes along. What has no map yet
// begins by all that is told: its start tells what does not fit.
bool tells_map(const PatchMatch& match) noexcept {
  constexpr double kLargestDeviation_px = 0.55;
  return larger_eigenvalue(match.covariance_px2) <= kLargestDeviation_px * kLargestDeviation_px;
}

// Whether it is where the map has it. A match that is looser than what the map learns from vouches only for a converged
// feature, and where half of all that is right would lie, however loose it is: chi-squared, 50 %, of the prediction
// alone.
bool agrees_with_map(const FeatureSlot& slot, const PixelPrediction& from_map, double gate) noexcept {
  constexpr double kLooseGate = 1.39;
  if (slot.match.state != MatchState::kFound || !from_map.valid || is_vague(slot.match)) return false;
  if (tells_map(slot.match)) return agrees(slot.match, from_map, gate);
  const Vector2d r = slot.match.px - from_map.px;
  return slot.converged && r.dot(from_map.covariance_px2.inverse() * r) <= kLooseGate;
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

// The last view is made only when it is needed; the frame before is there for one frame.
void make_last_view(FeatureSlot& slot, const FrameJob& job) noexcept {
  if (job.before.data == nullptr || frames_since_found(slot, job) != 1) return;
  slot.last_view.make(job.before, slot.last_found_frame, slot.patch_state.px, job.tracker->kernels());
}

// Whether a match may be believed without looking like the feature.
enum class Looks : std::uint8_t { kAskedInDoubt, kAskedAlways };
// Whether a release waits for it.
enum class Hurry : std::uint8_t { kNone, kRelease };

// What the first view has found: the feature; a place that is vague, and would lead the next searches astray, in a
// picture that has lost its contrast there; or nothing that can be believed.
enum class ByFirstView : std::uint8_t { kFound, kFaded, kNothing };

// Of the first view's contrast: what smoke and blur leave less of. Tissue in vivo that changes its looks keeps it.
constexpr double kFadedGain = 0.7;

ByFirstView seek_first_view(FeatureSlot& slot, const PixelPrediction& prediction, Looks looks,
                            const FrameJob& job) noexcept {
  slot.seen = slot.patch_state;
  slot.seen_by_last_view = false;
  slot.match = job.tracker->track(job.image, slot.patch, slot.seen, prediction.px, prediction.covariance_px2);
  if (slot.match.state != MatchState::kFound) return ByFirstView::kNothing;
  const std::uint64_t frames = frames_since_found(slot, job);
  const bool is_asked =
      looks == Looks::kAskedAlways || is_doubtful(prediction, slot.match.px, frames, unmapped_motion_px(job));
  const double usual_frames = static_cast<double>(frames) * job.frame->rate.of_usual();
  const bool is_other =
      is_asked && !slot.looks.is_plausible(slot.patch_state, slot.seen, slot.match.correlation, usual_frames);
  if (!is_other && !is_vague(slot.match)) return ByFirstView::kFound;
  slot.match.state = MatchState::kLowCorrelation;
  return !is_other && slot.seen.gain < kFadedGain ? ByFirstView::kFaded : ByFirstView::kNothing;
}

// As it looked in the frame before; and for a while, what has come back as it looked last, which the release need not
// wait for.
PatchMatch follow_last_view(FeatureSlot& slot, const PixelPrediction& prediction, Hurry hurry,
                            const FrameJob& job) noexcept {
  if (job.view_tracker == nullptr) return {};
  const std::uint64_t frames = frames_since_found(slot, job);
  if (frames == 1) {
    make_last_view(slot, job);
    if (!slot.last_view.is_of(slot.last_found_frame)) return {};
    return slot.last_view.follow(*job.view_tracker, job.image, job.before, slot.patch_state.px, prediction.px,
                                 prediction.covariance_px2);
  }
  if (hurry == Hurry::kNone && slot.last_view.is_of(slot.last_found_frame) &&
      frames <= job.frame->rate.frames(kLastViewKept)) {
    return slot.last_view.find_again(*job.view_tracker, job.image, prediction.px, prediction.covariance_px2);
  }
  return {};
}

void take_last_view(FeatureSlot& slot, const PatchMatch& match) noexcept {
  slot.match = match;
  slot.seen = slot.patch_state;
  slot.seen.px = match.px;
  slot.seen_by_last_view = true;
}

void seek_last_view(FeatureSlot& slot, const PixelPrediction& prediction, Hurry hurry, const FrameJob& job) noexcept {
  const PatchMatch match = follow_last_view(slot, prediction, hurry, job);
  if (match.state == MatchState::kFound) take_last_view(slot, match);
}

// Where the first view fits badly, the place near by that looks most like it may be another. Such a match would end the
// last view's drift as well, and the next slip would begin where this one has ended. Followed from the frame before,
// the feature leads to where it is, as far off as its drift says; the first view must have found it there. True when
// that is taken instead.
bool hold_against_last_view(FeatureSlot& slot, const PixelPrediction& prediction, const FrameJob& job) noexcept {
  if (slot.seen_by_last_view || slot.match.correlation >= kSureCorrelation || !prediction.valid) return false;
  if (frames_since_found(slot, job) != 1) return false;
  const PatchMatch followed = follow_last_view(slot, prediction, Hurry::kNone, job);
  if (followed.state != MatchState::kFound) return false;
  const Vector2d off_px = slot.match.px - followed.px;
  // By how much the first view was off a frame ago it is off now.
  const double besides_px2 = kSlide_px * kSlide_px - slot.last_view.began_px2();
  const Matrix2d C = slot.match.covariance_px2 + followed.covariance_px2 + besides_px2 * Matrix2d::Identity();
  if (off_px.dot(C.inverse() * off_px) <= kSamePlaceGate) return false;
  take_last_view(slot, followed);
  return true;
}

void seek(FeatureSlot& slot, const PixelPrediction& prediction, Looks looks, Hurry hurry, const FrameJob& job,
          const PipelineSettings& settings) noexcept {
  slot.match = PatchMatch{};
  if (!prediction.valid || !settings.camera.contains(prediction.px)) return;
  // Where the picture has faded the tissue looks as before: the frame before had faded as well, and a view of it would
  // only drift.
  if (seek_first_view(slot, prediction, looks, job) == ByFirstView::kNothing) {
    seek_last_view(slot, prediction, hurry, job);
  }
}

// What was found is believed: the next search builds on it.
void believe(FeatureSlot& slot, const FrameJob& job) noexcept {
  slot.velocity_px =
      frames_since_found(slot, job) == 1 ? Vector2d(slot.match.px - slot.patch_state.px) : Vector2d::Zero();
  slot.patch_state = slot.seen;
  slot.carried_px = slot.match.px;
  if (slot.seen_by_last_view) {
    slot.last_view.drift_to(slot.match);
  } else {
    slot.last_view.begin_at(larger_eigenvalue(slot.match.covariance_px2));
    slot.looks.add(slot.match.correlation);
    renew_stale_template(slot, job);
  }
  slot.last_found_frame = job.frame->index;
  if (!is_vague(slot.match)) slot.last_told_frame = job.frame->index;
}

// A jump that what is around it did not make. What the map knows well needs no neighbours: the frame's other matches
// have judged it.
bool moves_otherwise(const FeatureSlot& slot, const PixelPrediction& from_neighbours, double gate) noexcept {
  if (slot.converged || !from_neighbours.valid) return false;
  PatchMatch since_last = slot.match;
  if (slot.seen_by_last_view) {
    since_last.covariance_px2 -= (slot.last_view.began_px2() + slot.last_view.drift_px2()) * Matrix2d::Identity();
  }
  return !agrees(since_last, from_neighbours, gate);
}

// Where the map has it, by the pose that the frame's matches share if they tell one.
PixelPrediction predict_now(const MapPrediction& map, const FrameJob& job, const PixelModel& model) noexcept {
  if (!map.valid || job.shared_pose == nullptr) return predict_from_map(map, *job.frame, model);
  return predict_from_shared_pose(map, *job.shared_pose, *job.frame, model);
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
  const PixelPrediction wide = surer(widened(from_map, map, *job.frame, model), predict_from_velocity(slot, job));
  Looks looks = Looks::kAskedInDoubt;
  if (job.shift.known && from_map.valid && job.frame->search_deviation_mm == 0.0) {
    const PixelPrediction near = predict_from_map(map, *job.frame, model, job.shift);
    if (near.valid && near.covariance_px2.trace() < wide.covariance_px2.trace()) {
      seek(slot, near, looks, Hurry::kRelease, job, settings);
      looks = Looks::kAskedAlways;  // what is found where the others are not
    }
  }
  if (slot.match.state != MatchState::kFound) seek(slot, wide, looks, Hurry::kRelease, job, settings);
  if (slot.match.state != MatchState::kFound) return;
  slot.match_agrees = agrees_with_map(slot, from_map, settings.estimator.update.gate);
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
    const PixelPrediction from_map = predict_now(map, job, model);
    seek(slot, surer(from_map, from_neighbours.valid ? from_neighbours : predict_from_last_place(slot, job)),
         Looks::kAskedAlways, Hurry::kNone, job, settings);
    slot.match_agrees = agrees_with_map(slot, from_map, gate);
  }
  if (slot.match.state == MatchState::kFound) {
    if (hold_against_last_view(slot, from_neighbours.valid ? from_neighbours : predict_from_velocity(slot, job), job)) {
      const PixelPrediction from_map = predict_now(map, job, model);
      slot.match_agrees = agrees_with_map(slot, from_map, gate);
    }
    believe(slot, job);
  } else {
    make_last_view(slot, job);
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

namespace {

// Of itself, and of the set-up that it was seen by.
bool is_certain(const FeatureSlot& slot, const FrameDoubts& doubts) noexcept {
  return slot.converged && !slot.pressed && slot.largest_deviation_mm <= doubts.converged_within_mm;
}

}  // namespace

void describe(const FeatureSlot& slot, Instant now, const FrameDoubts& doubts, FeatureSnapshot& snapshot) noexcept {
  snapshot.id = slot.id;
  snapshot.last_observed = slot.last_observed;
  snapshot.expected = slot.in_view && !slot.shed;
  snapshot.in_sight = slot.match_agrees || now - slot.last_observed <= Sight::kLately;
  snapshot.first_observed = slot.first_observed;
  snapshot.first_observed_px = slot.first_observed_px;
  snapshot.largest_deviation_mm = slot.largest_deviation_mm;
  snapshot.held_back = slot.converged && !slot.pressed && !is_certain(slot, doubts);
  if (slot.pressed || slot.health.state() == HealthState::kInconsistent) {
    snapshot.state = FeatureState::kInconsistent;
    snapshot.reason = FeatureReason::kInnovationsHigh;
    return;
  }
  snapshot.state = is_called_converged(slot, now, doubts) ? FeatureState::kConverged : FeatureState::kConverging;
  if (slot.shed) {
    snapshot.reason = FeatureReason::kShed;
  } else if (!is_certain(slot, doubts)) {
    snapshot.reason = FeatureReason::kDeviationLarge;
  } else {
    snapshot.reason = slot.match_agrees ? FeatureReason::kNone : FeatureReason::kNotObserved;
  }
}

bool is_called_converged(const FeatureSlot& slot, Instant now, const FrameDoubts& doubts) noexcept {
  if (!is_certain(slot, doubts) || slot.health.state() == HealthState::kInconsistent) return false;
  return slot.match_agrees || now - slot.last_observed <= kBelievedUnseen;
}

void add_lasting_errors(const FeatureSlot& slot, StateMatrix& P) noexcept {
  P *= slot.repeated.factor();
  if (slot.slow_error != nullptr) P += slot.slow_error->covariance();
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
  if (slot.pressed || is_vague(slot.match)) return;
  const bool teaches = slot.state != SlotState::kMapped || tells_map(slot.match);
  if (teaches && job.frame->held && (slot.state != SlotState::kTracked || is_wanted_for_start(slot, job))) {
    const PixelMap& picture = job.frame->picture;
    slot.held.push(
        {job.frame->index, picture.to_lens(slot.match.px), picture.covariance_to_lens(slot.match.covariance_px2)});
  }
  if (slot.match_agrees) slot.last_observed = job.frame->stamp.capture;
}

}  // namespace perimap

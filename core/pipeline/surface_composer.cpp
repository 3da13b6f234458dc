#include "core/pipeline/surface_composer.hpp"

#include <algorithm>

#include "core/periodic/periodic_motion.hpp"
#include "core/pipeline/phase_spread.hpp"
#include "core/pipeline/surface_state.hpp"
#include "core/pipeline/surface_use.hpp"
#include "core/realtime/realtime_scope.hpp"

namespace perimap {
SurfaceComposer::SurfaceComposer(const ComposerSettings& settings) : settings_(settings) {
  sample_.features.reserve(settings.maximum_features);
  sample_.use_within_mm = settings.use_within_mm;
  order_.reserve(settings.maximum_features);
}

SurfaceComposer::Covered SurfaceComposer::covered_by(const ShardSnapshot& snapshot, const Release& release,
                                                     Instant valid) noexcept {
  const bool of_frames = release.stream == ReleaseStream::kFrame;
  if (of_frames && release.frame_missing) return {};
  const std::size_t begin = of_frames ? 0 : kReleasesCovered;
  const std::size_t end = of_frames ? kReleasesCovered : kCovariances;
  for (std::size_t i = begin + 1; i < end; ++i) {
    const Instant before = snapshot.instants[i - 1];
    const Instant after = snapshot.instants[i];
    if (before > valid || valid > after || before == after) continue;
    return {true, i - 1, i, to_seconds(valid - before) / to_seconds(after - before)};
  }
  return {};
}

// Where the snapshot was not evaluated (the update is late, or there is no frame), the largest deviation over the cycle
// bounds it.
Matrix3d SurfaceComposer::map_covariance(const FeatureSnapshot& feature, const Covered& covered,
                                         const FrameDoubts& doubts) noexcept {
  if (!covered.any) {
    const double largest_mm = doubts.largest_deviation_mm(feature.largest_deviation_mm);
    return Matrix3d::Identity() * (largest_mm * largest_mm);
  }
  return (1.0 - covered.share) * feature.covariances_W_mm2[covered.before] +
         covered.share * feature.covariances_W_mm2[covered.after] + doubts.setup_variance_mm2() * Matrix3d::Identity();
}

// Which frame the sample belongs to, which update is its oldest, and where the camera was. Whether that update is of a
// frame before the release's.
bool SurfaceComposer::rest_on(const Release& release, std::span<const ShardSnapshot* const> snapshots) noexcept {
  sample_.release = release;
  sample_.camera = {};
  const auto of_this_run = [](const ShardSnapshot& s) { return s.any && !s.recalled; };
  const ShardSnapshot* oldest = nullptr;
  for (const ShardSnapshot* snapshot : snapshots) {
    const bool older =
        oldest == nullptr || !of_this_run(*snapshot) || snapshot->frame_sequence < oldest->frame_sequence;
    if (older && (oldest == nullptr || of_this_run(*oldest))) oldest = snapshot;
    if (release.stream == ReleaseStream::kClock || !of_this_run(*snapshot) || release.frame_missing) continue;
    const auto has_it = [&](const FrameCamera& camera) { return camera.frame_sequence == release.frame_sequence; };
    const auto found = std::find_if(snapshot->cameras.begin(), snapshot->cameras.end(), has_it);
    if (found != snapshot->cameras.end() && found->place.known) sample_.camera = found->place;
  }
  const bool mapped = oldest != nullptr && of_this_run(*oldest);
  sample_.oldest_shard_frame_sequence = mapped ? oldest->frame_sequence : 0;
  const bool behind = !mapped || oldest->frame_sequence < release.frame_sequence;
  if (release.stream != ReleaseStream::kClock || oldest == nullptr || !oldest->any) return behind;
  sample_.release.frame_sequence = sample_.oldest_shard_frame_sequence;
  sample_.release.capture = oldest->capture;
  sample_.release.frame_missing = release.frame_missing && behind;
  sample_.camera = oldest->camera;
  return behind;
}

const SurfaceSample& SurfaceComposer::compose(const Release& release, const CardiacClock& clock,
                                              const RespiratoryClock& respiration,
                                              std::span<const ShardSnapshot* const> snapshots) noexcept {
  const RealtimeScope realtime;
  ++sample_.sample_sequence;
  sample_.valid_time = release.deadline + settings_.lead;
  sample_.valid_until = sample_.valid_time + settings_.validity;
  const bool behind = rest_on(release, snapshots);

  order_.clear();
  for (const ShardSnapshot* snapshot : snapshots) {
    const Covered covered = covered_by(*snapshot, release, sample_.valid_time);
    for (const FeatureSnapshot& feature : snapshot->features) order_.push_back({&feature, covered});
  }
  std::sort(order_.begin(), order_.end(),
            [](const Ordered& a, const Ordered& b) { return a.feature->id < b.feature->id; });

  const PhaseEstimate phase = clock.at(sample_.valid_time);
  sample_.cardiac_phase_rad = phase.phase_rad;
  sample_.cardiac_phase_deviation_rad = phase.deviation_s * phase.rate_rad_per_s;
  sample_.cardiac_phase_rate_rad_per_s = phase.rate_rad_per_s;
  const bool missing = sample_.release.frame_missing;
  const bool late = behind && !missing;
  sample_.update_late = late;
  SurfaceFooting footing = footing_of(snapshots);
  footing.breath_doubtful = respiration.doubtful();
  footing.frame_missing = missing;
  footing.update_late = late;
  sample_.reason = reason_of(phase, clock.rhythm(), footing);
  sample_.state = state_of(sample_.reason);

  const RespiratoryPhase breath = respiration.at(sample_.valid_time);
  const Basis b = basis_at(settings_.layout, phase.phase_rad, breath);
  const BasesAbout about = bases_about(settings_.layout, phase, breath);
  const Basis b_breath_rate = breath_rate(settings_.layout, breath.phase_rad);
  const Matrix3d of_breath = breath.deviation_mm * breath.deviation_mm * Matrix3d::Identity();
  const Basis b_rate = basis_rate(settings_.layout, phase.phase_rad);
  sample_.features.clear();
  for (const auto& [snapshot, covered] : order_) {
    SurfaceFeature feature;
    feature.id = snapshot->id;
    feature.p_WF_mm = position_of(snapshot->x, b);
    feature.velocity_W_mm_per_s = velocity_of(snapshot->x, b_rate, phase.rate_rad_per_s) +
                                  velocity_of(snapshot->x, b_breath_rate, breath.rate_rad_per_s);
    feature.covariance_W_mm2 =
        phase_spread(feature.p_WF_mm, position_of(snapshot->x, about.earlier), position_of(snapshot->x, about.later));
    feature.covariance_W_mm2 += map_covariance(*snapshot, covered, footing.doubts);
    feature.covariance_W_mm2 += of_breath;
    feature.last_observed = snapshot->last_observed;
    const FeatureVerdict verdict = verdict_of({snapshot->state, snapshot->reason}, phase.state, footing);
    feature.state = verdict.state;
    feature.reason = verdict.reason;
    sample_.features.push_back(feature);
  }
  const bool accounted_for = is_accounted_for(phase, clock.rhythm(), footing);
  sample_.uses = verdicts_by_use(sample_.state, accounted_for, sample_.features, sample_.use_within_mm);
  return sample_;
}

}  // namespace perimap

#include "core/pipeline/surface_composer.hpp"

#include <algorithm>
#include <limits>

#include "core/periodic/periodic_motion.hpp"
#include "core/pipeline/phase_spread.hpp"
#include "core/pipeline/surface_state.hpp"
#include "core/realtime/realtime_scope.hpp"

namespace perimap {
SurfaceComposer::SurfaceComposer(const ComposerSettings& settings) : settings_(settings) {
  sample_.features.reserve(settings.maximum_features);
  order_.reserve(settings.maximum_features);
}

const SurfaceSample& SurfaceComposer::compose(const Release& release, const CardiacClock& clock,
                                              const RespiratoryClock& respiration,
                                              std::span<const ShardSnapshot* const> snapshots) noexcept {
  const RealtimeScope realtime;
  ++sample_.sample_sequence;
  sample_.release = release;
  sample_.valid_time = release.deadline + settings_.lead;
  sample_.valid_until = sample_.valid_time + settings_.validity;

  order_.clear();
  bool pose_missing = false;
  sample_.camera = {};
  std::uint64_t oldest = std::numeric_limits<std::uint64_t>::max();
  for (const ShardSnapshot* snapshot : snapshots) {
    oldest = std::min(oldest, snapshot->any ? snapshot->frame_sequence : 0);
    pose_missing = pose_missing || snapshot->pose_missing;
    const auto covered =
        std::find(snapshot->release_sequences.begin(), snapshot->release_sequences.end(), release.frame_sequence);
    const auto i = static_cast<std::size_t>(covered - snapshot->release_sequences.begin());
    if (i < kReleasesCovered && snapshot->any && !release.frame_missing) sample_.camera = snapshot->cameras[i];
    for (const FeatureSnapshot& feature : snapshot->features) order_.push_back({&feature, i});
  }
  std::sort(order_.begin(), order_.end(),
            [](const Ordered& a, const Ordered& b) { return a.feature->id < b.feature->id; });

  const PhaseEstimate phase = clock.at(sample_.valid_time);
  sample_.oldest_shard_frame_sequence = oldest;
  sample_.cardiac_phase_rad = phase.phase_rad;
  sample_.cardiac_phase_deviation_rad = phase.deviation_s * phase.rate_rad_per_s;
  sample_.cardiac_phase_rate_rad_per_s = phase.rate_rad_per_s;
  const bool late = oldest < release.frame_sequence && !release.frame_missing;
  sample_.update_late = late;
  const SurfaceFooting footing{.breath_unknown = respiration.unknown(),
                               .mapped = !order_.empty(),
                               .frame_missing = release.frame_missing,
                               .update_late = late,
                               .pose_missing = pose_missing};
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
    // Where the snapshot was not evaluated at this release (the update is late, or there is no frame), the largest
    // deviation over the cycle bounds the covariance.
    feature.covariance_W_mm2 =
        phase_spread(feature.p_WF_mm, position_of(snapshot->x, about.earlier), position_of(snapshot->x, about.later));
    feature.covariance_W_mm2 +=
        covered < kReleasesCovered && !release.frame_missing
            ? snapshot->covariances_W_mm2[covered]
            : Matrix3d(Matrix3d::Identity() * snapshot->largest_deviation_mm * snapshot->largest_deviation_mm);
    feature.covariance_W_mm2 += of_breath;
    feature.last_observed = snapshot->last_observed;
    const FeatureVerdict verdict = verdict_of({snapshot->state, snapshot->reason}, phase.state, footing);
    feature.state = verdict.state;
    feature.reason = verdict.reason;
    sample_.features.push_back(feature);
  }
  return sample_;
}

}  // namespace perimap

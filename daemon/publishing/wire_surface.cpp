#include "daemon/publishing/wire_surface.hpp"

#include <algorithm>

#include "core/realtime/realtime_scope.hpp"
#include "daemon/publishing/wire_text.hpp"

namespace perimap {

perimap_SurfaceState to_wire(SurfaceState state) noexcept {
  switch (state) {
    case SurfaceState::kGood:
      return perimap_SURFACE_GOOD;
    case SurfaceState::kDegraded:
      return perimap_SURFACE_DEGRADED;
    case SurfaceState::kInvalid:
      return perimap_SURFACE_INVALID;
  }
  return perimap_SURFACE_INVALID;
}

perimap_SurfaceReason to_wire(SurfaceReason reason) noexcept {
  switch (reason) {
    case SurfaceReason::kNone:
      return perimap_SURFACE_REASON_NONE;
    case SurfaceReason::kNothingMapped:
      return perimap_SURFACE_REASON_NOTHING_MAPPED;
    case SurfaceReason::kPhaseUnknown:
      return perimap_SURFACE_REASON_PHASE_UNKNOWN;
    case SurfaceReason::kPhaseFreeRunning:
      return perimap_SURFACE_REASON_PHASE_FREE_RUNNING;
    case SurfaceReason::kPhaseLost:
      return perimap_SURFACE_REASON_PHASE_LOST;
    case SurfaceReason::kFrameMissing:
      return perimap_SURFACE_REASON_FRAME_MISSING;
    case SurfaceReason::kUpdateLate:
      return perimap_SURFACE_REASON_UPDATE_LATE;
    case SurfaceReason::kPoseMissing:
      return perimap_SURFACE_REASON_POSE_MISSING;
    case SurfaceReason::kPhaseContradicted:
      return perimap_SURFACE_REASON_PHASE_CONTRADICTED;
    case SurfaceReason::kRespirationUnknown:
      return perimap_SURFACE_REASON_RESPIRATION_UNKNOWN;
    case SurfaceReason::kPhaseFromImage:
      return perimap_SURFACE_REASON_PHASE_FROM_IMAGE;
    case SurfaceReason::kEctopicBeat:
      return perimap_SURFACE_REASON_ECTOPIC_BEAT;
    case SurfaceReason::kRhythmUnpredictable:
      return perimap_SURFACE_REASON_RHYTHM_UNPREDICTABLE;
    case SurfaceReason::kRhythmEctopic:
      return perimap_SURFACE_REASON_RHYTHM_ECTOPIC;
    case SurfaceReason::kLawUndecided:
      return perimap_SURFACE_REASON_LAW_UNDECIDED;
    case SurfaceReason::kNotSeen:
      return perimap_SURFACE_REASON_NOT_SEEN;
  }
  return perimap_SURFACE_REASON_NOTHING_MAPPED;
}

perimap_FeatureState to_wire(FeatureState state) noexcept {
  switch (state) {
    case FeatureState::kConverged:
      return perimap_FEATURE_CONVERGED;
    case FeatureState::kConverging:
      return perimap_FEATURE_CONVERGING;
    case FeatureState::kInconsistent:
      return perimap_FEATURE_INCONSISTENT;
    case FeatureState::kInvalid:
      return perimap_FEATURE_INVALID;
  }
  return perimap_FEATURE_INVALID;
}

perimap_FeatureReason to_wire(FeatureReason reason) noexcept {
  switch (reason) {
    case FeatureReason::kNone:
      return perimap_FEATURE_REASON_NONE;
    case FeatureReason::kNotObserved:
      return perimap_FEATURE_REASON_NOT_OBSERVED;
    case FeatureReason::kDeviationLarge:
      return perimap_FEATURE_REASON_DEVIATION_LARGE;
    case FeatureReason::kInnovationsHigh:
      return perimap_FEATURE_REASON_INNOVATIONS_HIGH;
    case FeatureReason::kPhaseLost:
      return perimap_FEATURE_REASON_PHASE_LOST;
    case FeatureReason::kShed:
      return perimap_FEATURE_REASON_SHED;
  }
  return perimap_FEATURE_REASON_PHASE_LOST;
}

WireSurface::WireSurface(const Identity& identity, std::size_t maximum_features) : features_(maximum_features) {
  copy_text(identity.source, wire_.source);
  copy_text(name_of(identity.stream), wire_.stream);
  copy_text(identity.frame_id, wire_.frame_id);
  wire_.features._buffer = features_.data();
  wire_.features._maximum = static_cast<std::uint32_t>(features_.size());
  wire_.features._release = false;
}

std::vector<WireSurface> wire_surfaces(const Identity& identity, const PipelineSettings& settings) {
  std::vector<WireSurface> surfaces;
  surfaces.reserve(kReleaseStreams.size());
  for (const ReleaseStream stream : kReleaseStreams) {
    surfaces.emplace_back(identity.of(stream), static_cast<std::size_t>(settings.features.maximum));
  }
  return surfaces;
}

const perimap_Surface& WireSurface::fill(const SurfaceSample& sample, Duration utc_minus_monotonic) noexcept {
  const RealtimeScope realtime;
  wire_.sample_sequence = sample.sample_sequence;
  wire_.frame_sequence = sample.release.frame_sequence;
  wire_.capture_time_ns = to_ns(sample.release.capture);
  wire_.release_time_ns = to_ns(sample.release.deadline);
  wire_.valid_time_ns = to_ns(sample.valid_time);
  wire_.valid_until_ns = to_ns(sample.valid_until);
  wire_.release_utc_ns = to_ns(sample.release.deadline + utc_minus_monotonic);
  wire_.state = to_wire(sample.state);
  wire_.reason = to_wire(sample.reason);
  wire_.oldest_shard_frame_sequence = sample.oldest_shard_frame_sequence;
  wire_.cardiac_phase_rad = sample.cardiac_phase_rad;
  wire_.cardiac_phase_deviation_rad = sample.cardiac_phase_deviation_rad;
  wire_.cardiac_phase_rate_rad_per_s = sample.cardiac_phase_rate_rad_per_s;
  wire_.camera_pose_known = sample.camera.known;
  std::copy_n(sample.camera.X_WC.t.data(), 3, wire_.translation_WC_mm);
  rotation_to_wxyz(sample.camera.X_WC.R, wire_.rotation_WC_wxyz);
  const std::size_t count = std::min(sample.features.size(), features_.size());
  wire_.features._length = static_cast<std::uint32_t>(count);
  for (std::size_t i = 0; i < count; ++i) {
    const SurfaceFeature& feature = sample.features[i];
    perimap_SurfaceFeature& out = features_[i];
    out.id = feature.id;
    out.state = to_wire(feature.state);
    out.reason = to_wire(feature.reason);
    for (int axis = 0; axis < 3; ++axis) {
      out.position_W_mm[axis] = feature.p_WF_mm[axis];
      out.velocity_W_mm_per_s[axis] = feature.velocity_W_mm_per_s[axis];
    }
    const Matrix3d& P = feature.covariance_W_mm2;
    const double upper[6] = {P(0, 0), P(0, 1), P(0, 2), P(1, 1), P(1, 2), P(2, 2)};
    std::copy_n(upper, 6, out.covariance_W_mm2);
    out.last_observed_time_ns = to_ns(feature.last_observed);
  }
  return wire_;
}

}  // namespace perimap

#include "daemon/publishing/wire_surface.hpp"

#include <algorithm>

#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "core/realtime/realtime_scope.hpp"
#include "daemon/publishing/wire_states.hpp"
#include "daemon/publishing/wire_text.hpp"

namespace perimap {

WireSurface::WireSurface(const Identity& identity, std::size_t maximum_features) : features_(maximum_features) {
  name_as(wire_, identity);
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
  std::copy_n(sample.camera.lens.focal_px.data(), 2, wire_.camera_focal_px);
  std::copy_n(sample.camera.lens.principal_px.data(), 2, wire_.camera_principal_point_px);
  wire_.display_state = to_wire(sample.uses[0].state);
  wire_.measure_state = to_wire(sample.uses[1].state);
  wire_.contact_state = to_wire(sample.uses[2].state);
  for (std::size_t use = 0; use < kUses; ++use) {
    wire_.use_within_mm[use] = sample.use_within_mm[use];
    wire_.use_features[use] = sample.uses[use].features;
  }
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

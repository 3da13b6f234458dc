#include "tests/unit/recording/samples.hpp"

#include <cstdio>
#include <string>
#include <type_traits>

namespace perimap::test {
namespace {

// Gives values that are never zero and never repeat within a sample.
class Filler {
 public:
  explicit Filler(unsigned seed) : n_(1 + 1000 * seed) {}

  template <class T>
  void operator()(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      value = true;
    } else if constexpr (std::is_enum_v<T>) {
      value = static_cast<T>(1);
    } else if constexpr (std::is_same_v<T, std::int64_t>) {
      value = -(std::int64_t{1} << 60) - n_++;
    } else if constexpr (std::is_same_v<T, std::uint64_t>) {
      value = (std::uint64_t{1} << 63) + n_++;
    } else if constexpr (std::is_integral_v<T>) {
      value = static_cast<T>(1 + n_++ % 250);
    } else if constexpr (std::is_floating_point_v<T>) {
      value = static_cast<T>(n_++) / T{3};
    }
  }
  template <class T, std::size_t N>
  void operator()(T (&values)[N]) {
    if constexpr (std::is_same_v<T, char>) {
      std::snprintf(values, N, "text %u", n_++);
    } else {
      for (T& value : values) (*this)(value);
    }
  }
  void operator()(char*& text) { text = dds_string_dup(("unbounded text " + std::to_string(n_++)).c_str()); }

  template <class Sequence, class Fill>
  void sequence(Sequence& values, std::uint32_t length, Fill fill) {
    using T = std::remove_pointer_t<decltype(values._buffer)>;
    values._buffer = static_cast<T*>(dds_alloc(length * sizeof(T)));
    values._length = values._maximum = length;
    values._release = true;
    for (std::uint32_t i = 0; i < length; ++i) fill(values._buffer[i]);
  }
  template <class Sequence>
  void sequence(Sequence& values, std::uint32_t length) {
    sequence(values, length, [this](auto& value) { (*this)(value); });
  }

 private:
  std::uint32_t n_;
};

void fill(Filler& next, perimap_SurfaceFeature& s) {
  next(s.id);
  next(s.state);
  next(s.reason);
  next(s.position_W_mm);
  next(s.velocity_W_mm_per_s);
  next(s.covariance_W_mm2);
  next(s.last_observed_time_ns);
}

void fill(Filler& next, perimap_Surface& s) {
  next(s.source);
  next(s.stream);
  next(s.frame_id);
  next(s.sample_sequence);
  next(s.frame_sequence);
  next(s.capture_time_ns);
  next(s.release_time_ns);
  next(s.valid_time_ns);
  next(s.valid_until_ns);
  next(s.release_utc_ns);
  next(s.state);
  next(s.reason);
  next(s.oldest_shard_frame_sequence);
  next(s.cardiac_phase_rad);
  next(s.cardiac_phase_deviation_rad);
  next(s.cardiac_phase_rate_rad_per_s);
  next.sequence(s.features, 3, [&](auto& feature) { fill(next, feature); });
  next(s.camera_pose_known);
  next(s.translation_WC_mm);
  next(s.rotation_WC_wxyz);
  next(s.camera_focal_px);
  next(s.camera_principal_point_px);
  next(s.run_id);
  next(s.display_state);
  next(s.measure_state);
  next(s.contact_state);
  next(s.use_within_mm);
  next(s.use_features);
}

void fill(Filler& next, perimap_PhaseClock& s) {
  next(s.state);
  next(s.law);
  next(s.anchor_time_ns);
  next(s.anchor_deviation_ns);
  next(s.length_ns);
  next(s.length_deviation_ns);
  next(s.systole_ns);
  next(s.systole_fraction);
  next(s.locked_systole_ns);
  next(s.locked_filling_ns);
  next(s.locked_systole_phase_rad);
  next(s.locked_filling_phase_rad);
  next(s.law_probabilities);
}

void fill(Filler& next, perimap_RespiratoryClock& s) {
  next(s.state);
  next(s.anchor_time_ns);
  next(s.length_ns);
  next(s.deviation_mm);
  next(s.slope_mm_per_rad);
  next(s.phase_variance_rad2);
  next(s.phase_rate_covariance_rad2_per_s);
  next(s.rate_variance_rad2_per_s2);
}

void fill(Filler& next, perimap_CardiacCycle& s) {
  next(s.measured);
  next(s.stretches);
  next(s.begin_time_ns);
  next(s.begin_deviation_ns);
  next(s.length_ns);
  next(s.length_deviation_ns);
  next(s.irregularity_ns);
  next(s.systole_ns);
  next(s.locked_systole_ns);
  next(s.locked_filling_ns);
  next(s.systole_slope);
  next(s.previous_length_deviation_ns);
}

void fill(Filler& next, perimap_ModelFeature& s) {
  next(s.id);
  next(s.state);
  next(s.reason);
  next(s.first_observed_time_ns);
  next(s.first_observed_px);
  next(s.largest_deviation_mm);
  next.sequence(s.coefficients_W_mm, 5);
  next(s.last_observed_time_ns);
}

void fill(Filler& next, perimap_SurfaceModel& s) {
  next(s.source);
  next(s.stream);
  next(s.frame_id);
  next(s.sample_sequence);
  next(s.time_ns);
  next(s.cardiac_harmonics);
  next(s.respiratory_harmonics);
  fill(next, s.cardiac_clock);
  next.sequence(s.features, 2, [&](auto& feature) { fill(next, feature); });
  fill(next, s.respiratory_clock);
  next(s.state);
  next(s.reason);
  next(s.time_utc_ns);
  next(s.valid_from_ns);
  next(s.expected_until_ns);
  next(s.valid_until_ns);
  next.sequence(s.cardiac_cycles, 2, [&](auto& cycle) { fill(next, cycle); });
  next(s.run_id);
}

void fill(Filler& next, perimap_Phase& s) {
  next(s.source);
  next(s.stream);
  next(s.sample_sequence);
  next(s.time_ns);
  next(s.state);
  next(s.cardiac_phase_rad);
  next(s.cardiac_phase_deviation_rad);
  next(s.cardiac_phase_rate_rad_per_s);
  next(s.last_r_peak_time_ns);
  next(s.predicted_r_peak_time_ns);
  next(s.predicted_r_peak_deviation_ns);
  next(s.beats);
  next(s.run_id);
}

void fill(Filler& next, perimap_SourceStatus& s) {
  next(s.kind);
  next(s.state);
  next(s.received);
  next(s.dropped);
  next(s.invalid);
  next(s.last_source_time_ns);
  next(s.delay_p50_ns);
  next(s.delay_max_ns);
  next(s.jitter_p50_ns);
  next(s.jitter_p99_ns);
  next(s.rate_hz);
  next(s.delay_p99_ns);
  next(s.last_good_time_ns);
}

void fill(Filler& next, perimap_StageLatency& s) {
  next(s.kind);
  next(s.count);
  next(s.p50_ns);
  next(s.p99_ns);
  next(s.max_ns);
  next(s.p999_ns);
  next(s.recent_count);
  next(s.recent_p50_ns);
  next(s.recent_p99_ns);
  next(s.recent_p999_ns);
  next(s.recent_max_ns);
}

void fill(Filler& next, perimap_SetupWatch& s) {
  next(s.state);
  next(s.windows);
  next(s.blamed);
  next(s.numbers);
  next(s.deviations);
  next(s.surface_mm);
  next(s.surface_deviation_mm);
  next(s.widened_mm);
  next(s.first_doubted_ns);
  next(s.asked);
}

void fill(Filler& next, perimap_Status& s) {
  next(s.source);
  next(s.stream);
  next(s.sample_sequence);
  next(s.time_ns);
  next(s.version);
  next(s.realtime_priority);
  next(s.memory_locked);
  next(s.latency_ns);
  next(s.frames);
  next(s.frames_too_late);
  next(s.frames_without_pose);
  next(s.frames_without_phase);
  next(s.samples);
  next(s.samples_without_frame);
  next(s.samples_from_late_update);
  next(s.learning_put_off);
  next(s.adoptions_late);
  next(s.features_tracked);
  next(s.features_starting);
  next(s.features_converging);
  next(s.features_converged);
  next(s.features_inconsistent);
  next(s.features_lost);
  next.sequence(s.sources, 3, [&](auto& source) { fill(next, source); });
  next.sequence(s.stages, 2, [&](auto& stage) { fill(next, stage); });
  next(s.features_started_anew);
  next(s.phases_from_image);
  next(s.respiration);
  next(s.respiration_suspected);
  next(s.recording);
  next(s.messages_recorded);
  next(s.frames_not_recorded);
  next(s.other_not_recorded);
  next(s.phase_state);
  next(s.rhythm);
  next(s.latency_short);
  next(s.recent_ns);
  next(s.respiration_source);
  next(s.releases_missed);
  next(s.features_shed);
  next(s.times_shed);
  next(s.features_lost_unseen);
  next(s.features_lost_refused);
  next(s.features_lost_unstarted);
  next(s.starts_failed_unusable);
  next(s.starts_failed_behind);
  next(s.starts_failed_diverged);
  next(s.starts_failed_outliers);
  next(s.start_matches_needed);
  next(s.start_matches_most);
  next(s.start_matches_mean);
  next(s.releases_late);
  fill(next, s.setup);
  next(s.poses_repeated);
  next(s.frames_repeated);
  next(s.scope_turn);
  next(s.scope_rotation_rad);
  next(s.scope_turns);
  next(s.scope_frames_unread);
  next(s.ecg_first_lead);
  next(s.ecg_second_lead);
  next(s.run_id);
  next(s.two_publishers);
  next(s.keys_expire_utc_ns);
  next(s.displaced_mm);
  next(s.displaced_cause);
  next(s.times_displaced);
  next(s.maps_moved);
  next(s.ecg_samples_repeated);
}

void fill(Filler& next, perimap_SurfaceMesh& s) {
  next(s.source);
  next(s.frame_id);
  next(s.run_id);
  next(s.sample_sequence);
  next(s.time_ns);
  next(s.time_utc_ns);
  next(s.valid_until_ns);
  next(s.frame_sequence);
  next(s.state);
  next(s.reason);
  next(s.phase_law);
  next(s.cardiac_harmonics);
  next(s.respiratory_harmonics);
  next(s.features);
  next(s.features_contradicting);
  next(s.leave_one_out_rms_mm);
  next(s.leave_one_out_nees);
  next.sequence(s.vertex_states, 2);
  next.sequence(s.coefficients_W_mm, 9);
  next.sequence(s.covariances_W_mm2, 6);
  next.sequence(s.triangles, 3);
}

void fill(Filler& next, perimap_ToolDistance& s) {
  next(s.source);
  next(s.tool);
  next(s.frame_id);
  next(s.run_id);
  next(s.sample_sequence);
  next(s.surface_sequence);
  next(s.release_time_ns);
  next(s.release_utc_ns);
  next(s.time_ns);
  next(s.valid_until_ns);
  next(s.state);
  next(s.reason);
  next(s.surface_state);
  next(s.surface_reason);
  next(s.touches);
  next(s.tip_known);
  next(s.last_seen_time_ns);
  next(s.tip_W_mm);
  next(s.tip_velocity_W_mm_per_s);
  next(s.tip_covariance_W_mm2);
  next(s.nearest_W_mm);
  next(s.normal_W);
  next(s.states);
  next(s.reasons);
  next(s.distances_mm);
  next(s.deviations_mm);
  next(s.rates_mm_per_s);
}

void fill(Filler& next, perimap_TruthTool& s) {
  next(s.time_ns);
  next(s.tip_W_mm);
  next(s.distance_mm);
  next(s.touches);
}

void fill(Filler& next, perimap_TrackerPose& s) {
  next(s.source_time_ns);
  next(s.device_frame);
  next(s.state);
  next(s.translation_WS_mm);
  next(s.rotation_WS_wxyz);
  next(s.error_mm);
}

void fill(Filler& next, perimap_EcgSamples& s) {
  next(s.first_sample_time_ns);
  next(s.sample_period_ns);
  next(s.device_sequence);
  next(s.lead_off);
  next.sequence(s.ecg_mV, 7);
}

void fill(Filler& next, perimap_RTriggerPulse& s) {
  next(s.edge_time_ns);
  next(s.device_count);
}

void fill(Filler& next, perimap_RespirationSamples& s) {
  next(s.first_sample_time_ns);
  next(s.sample_period_ns);
  next(s.device_sequence);
  next(s.sensor_off);
  next.sequence(s.values, 5);
}

void fill(Filler& next, perimap_RecordingInfo& s) {
  next(s.generator);
  next(s.description);
  next(s.utc_minus_monotonic_ns);
  next(s.world_frame_id);
}

void fill(Filler& next, perimap_TruthMesh& s) {
  next(s.vertex_count);
  next(s.harmonics);
  next.sequence(s.coefficients_W_mm, 9);
  next.sequence(s.triangles, 6);
}

void fill(Filler& next, perimap_TruthMotion& s) {
  next(s.law);
  next.sequence(s.r_peak_time_ns, 4);
  next(s.systole_fraction);
  next(s.systole_offset_s);
  next(s.systole_slope_s_per_bpm);
  next(s.locked_systole_ns);
  next(s.locked_filling_ns);
  next(s.locked_systole_phase_rad);
  next(s.locked_filling_phase_rad);
  next(s.respiration_W_mm);
  next(s.respiration_period_ns);
}

void fill(Filler& next, perimap_TruthCamera& s) {
  next(s.capture_time_ns);
  next(s.translation_WC_mm);
  next(s.rotation_WC_wxyz);
  next(s.focal_px);
  next(s.principal_point_px);
  next(s.scope_rotation_rad);
}

void fill(Filler& next, foxglove_Time& s) {
  next(s.sec);
  next(s.nsec);
}

void fill(Filler& next, foxglove_PoseInFrame& s) {
  fill(next, s.timestamp);
  next(s.frame_id);
  next(s.pose.position.x);
  next(s.pose.position.y);
  next(s.pose.position.z);
  next(s.pose.orientation.x);
  next(s.pose.orientation.y);
  next(s.pose.orientation.z);
  next(s.pose.orientation.w);
}

void fill(Filler& next, foxglove_RawImage& s) {
  fill(next, s.timestamp);
  next(s.frame_id);
  next(s.width);
  next(s.height);
  next(s.encoding);
  next(s.step);
  next.sequence(s.data, 11);
}

void fill(Filler& next, foxglove_CompressedImage& s) {
  fill(next, s.timestamp);
  next(s.frame_id);
  next.sequence(s.data, 11);
  next(s.format);
}

}  // namespace

template <class T>
Sample<T> make_sample(unsigned seed) {
  Sample<T> sample;
  Filler next(seed);
  fill(next, sample.mutable_value());
  return sample;
}

template Sample<perimap_Surface> make_sample(unsigned);
template Sample<perimap_SurfaceModel> make_sample(unsigned);
template Sample<perimap_SurfaceMesh> make_sample(unsigned);
template Sample<perimap_ToolDistance> make_sample(unsigned);
template Sample<perimap_Phase> make_sample(unsigned);
template Sample<perimap_Status> make_sample(unsigned);
template Sample<perimap_TrackerPose> make_sample(unsigned);
template Sample<perimap_EcgSamples> make_sample(unsigned);
template Sample<perimap_RTriggerPulse> make_sample(unsigned);
template Sample<perimap_RespirationSamples> make_sample(unsigned);
template Sample<perimap_RecordingInfo> make_sample(unsigned);
template Sample<perimap_TruthMesh> make_sample(unsigned);
template Sample<perimap_TruthMotion> make_sample(unsigned);
template Sample<perimap_TruthCamera> make_sample(unsigned);
template Sample<perimap_TruthTool> make_sample(unsigned);
template Sample<foxglove_RawImage> make_sample(unsigned);
template Sample<foxglove_CompressedImage> make_sample(unsigned);
template Sample<foxglove_PoseInFrame> make_sample(unsigned);

}  // namespace perimap::test

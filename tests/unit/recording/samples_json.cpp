#include <string>
#include <type_traits>

#include "tests/unit/recording/samples.hpp"

namespace perimap::test {

using nlohmann::json;

namespace {

template <class T>
json value_json(const T& value) {
  if constexpr (std::is_same_v<T, std::int64_t> || std::is_same_v<T, std::uint64_t>) {
    return std::to_string(value);
  } else if constexpr (std::is_enum_v<T>) {
    return static_cast<std::uint32_t>(value);
  } else if constexpr (std::is_arithmetic_v<T>) {
    return value;
  } else {
    return to_json(value);
  }
}
template <class T, std::size_t N>
json value_json(const T (&values)[N]) {
  if constexpr (std::is_same_v<T, char>) {
    return std::string(values);
  } else {
    json array = json::array();
    for (const T& value : values) array.push_back(value_json(value));
    return array;
  }
}
json value_json(char* const& text) { return std::string(text == nullptr ? "" : text); }
template <class Sequence>
requires requires(const Sequence& s) { s._length; }
json value_json(const Sequence& values) {
  json array = json::array();
  for (std::uint32_t i = 0; i < values._length; ++i) array.push_back(value_json(values._buffer[i]));
  return array;
}

}  // namespace

#define MEMBER(name) \
  { #name, value_json(s.name) }

template <>
json to_json(const perimap_SurfaceFeature& s) {
  return {MEMBER(id),
          MEMBER(state),
          MEMBER(reason),
          MEMBER(position_W_mm),
          MEMBER(velocity_W_mm_per_s),
          MEMBER(covariance_W_mm2),
          MEMBER(last_observed_time_ns)};
}
template <>
json to_json(const perimap_Surface& s) {
  return {MEMBER(source),
          MEMBER(stream),
          MEMBER(frame_id),
          MEMBER(sample_sequence),
          MEMBER(frame_sequence),
          MEMBER(capture_time_ns),
          MEMBER(release_time_ns),
          MEMBER(valid_time_ns),
          MEMBER(valid_until_ns),
          MEMBER(release_utc_ns),
          MEMBER(state),
          MEMBER(reason),
          MEMBER(oldest_shard_frame_sequence),
          MEMBER(cardiac_phase_rad),
          MEMBER(cardiac_phase_deviation_rad),
          MEMBER(cardiac_phase_rate_rad_per_s),
          MEMBER(features),
          MEMBER(camera_pose_known),
          MEMBER(translation_WC_mm),
          MEMBER(rotation_WC_wxyz),
          MEMBER(camera_focal_px),
          MEMBER(camera_principal_point_px),
          MEMBER(run_id),
          MEMBER(display_state),
          MEMBER(measure_state),
          MEMBER(contact_state),
          MEMBER(use_within_mm),
          MEMBER(use_features)};
}
template <>
json to_json(const perimap_PhaseClock& s) {
  return {MEMBER(state),
          MEMBER(law),
          MEMBER(anchor_time_ns),
          MEMBER(anchor_deviation_ns),
          MEMBER(length_ns),
          MEMBER(length_deviation_ns),
          MEMBER(systole_ns),
          MEMBER(systole_fraction),
          MEMBER(locked_systole_ns),
          MEMBER(locked_filling_ns),
          MEMBER(locked_systole_phase_rad),
          MEMBER(locked_filling_phase_rad),
          MEMBER(law_probabilities)};
}
template <>
json to_json(const perimap_RespiratoryClock& s) {
  return {MEMBER(state),
          MEMBER(anchor_time_ns),
          MEMBER(length_ns),
          MEMBER(deviation_mm),
          MEMBER(slope_mm_per_rad),
          MEMBER(phase_variance_rad2),
          MEMBER(phase_rate_covariance_rad2_per_s),
          MEMBER(rate_variance_rad2_per_s2)};
}
template <>
json to_json(const perimap_CardiacCycle& s) {
  return {MEMBER(measured),           MEMBER(stretches),     MEMBER(begin_time_ns),
          MEMBER(begin_deviation_ns), MEMBER(length_ns),     MEMBER(length_deviation_ns),
          MEMBER(irregularity_ns),    MEMBER(systole_ns),    MEMBER(locked_systole_ns),
          MEMBER(locked_filling_ns),  MEMBER(systole_slope), MEMBER(previous_length_deviation_ns)};
}
template <>
json to_json(const perimap_ModelFeature& s) {
  return {MEMBER(id),
          MEMBER(state),
          MEMBER(reason),
          MEMBER(first_observed_time_ns),
          MEMBER(first_observed_px),
          MEMBER(largest_deviation_mm),
          MEMBER(coefficients_W_mm),
          MEMBER(last_observed_time_ns)};
}
template <>
json to_json(const perimap_SurfaceModel& s) {
  return {MEMBER(source),
          MEMBER(stream),
          MEMBER(frame_id),
          MEMBER(sample_sequence),
          MEMBER(time_ns),
          MEMBER(cardiac_harmonics),
          MEMBER(respiratory_harmonics),
          MEMBER(cardiac_clock),
          MEMBER(features),
          MEMBER(respiratory_clock),
          MEMBER(state),
          MEMBER(reason),
          MEMBER(time_utc_ns),
          MEMBER(valid_from_ns),
          MEMBER(expected_until_ns),
          MEMBER(valid_until_ns),
          MEMBER(cardiac_cycles),
          MEMBER(run_id)};
}
template <>
json to_json(const perimap_SurfaceMesh& s) {
  return {MEMBER(source),
          MEMBER(frame_id),
          MEMBER(run_id),
          MEMBER(sample_sequence),
          MEMBER(time_ns),
          MEMBER(time_utc_ns),
          MEMBER(valid_until_ns),
          MEMBER(frame_sequence),
          MEMBER(state),
          MEMBER(reason),
          MEMBER(phase_law),
          MEMBER(cardiac_harmonics),
          MEMBER(respiratory_harmonics),
          MEMBER(features),
          MEMBER(features_contradicting),
          MEMBER(leave_one_out_rms_mm),
          MEMBER(leave_one_out_nees),
          MEMBER(vertex_states),
          MEMBER(coefficients_W_mm),
          MEMBER(covariances_W_mm2),
          MEMBER(triangles)};
}
template <>
json to_json(const perimap_ToolDistance& s) {
  return {MEMBER(source),
          MEMBER(tool),
          MEMBER(frame_id),
          MEMBER(run_id),
          MEMBER(sample_sequence),
          MEMBER(surface_sequence),
          MEMBER(release_time_ns),
          MEMBER(release_utc_ns),
          MEMBER(time_ns),
          MEMBER(valid_until_ns),
          MEMBER(state),
          MEMBER(reason),
          MEMBER(surface_state),
          MEMBER(surface_reason),
          MEMBER(touches),
          MEMBER(tip_known),
          MEMBER(last_seen_time_ns),
          MEMBER(tip_W_mm),
          MEMBER(tip_velocity_W_mm_per_s),
          MEMBER(tip_covariance_W_mm2),
          MEMBER(nearest_W_mm),
          MEMBER(normal_W),
          MEMBER(states),
          MEMBER(reasons),
          MEMBER(distances_mm),
          MEMBER(deviations_mm),
          MEMBER(rates_mm_per_s)};
}
template <>
json to_json(const perimap_TruthTool& s) {
  return {MEMBER(time_ns), MEMBER(tip_W_mm), MEMBER(distance_mm), MEMBER(touches)};
}
template <>
json to_json(const perimap_Phase& s) {
  return {MEMBER(source),
          MEMBER(stream),
          MEMBER(sample_sequence),
          MEMBER(time_ns),
          MEMBER(state),
          MEMBER(cardiac_phase_rad),
          MEMBER(cardiac_phase_deviation_rad),
          MEMBER(cardiac_phase_rate_rad_per_s),
          MEMBER(last_r_peak_time_ns),
          MEMBER(predicted_r_peak_time_ns),
          MEMBER(predicted_r_peak_deviation_ns),
          MEMBER(beats),
          MEMBER(run_id)};
}
template <>
json to_json(const perimap_SourceStatus& s) {
  return {MEMBER(kind),
          MEMBER(state),
          MEMBER(received),
          MEMBER(dropped),
          MEMBER(invalid),
          MEMBER(last_source_time_ns),
          MEMBER(delay_p50_ns),
          MEMBER(delay_max_ns),
          MEMBER(jitter_p50_ns),
          MEMBER(jitter_p99_ns),
          MEMBER(rate_hz),
          MEMBER(delay_p99_ns),
          MEMBER(last_good_time_ns)};
}
template <>
json to_json(const perimap_StageLatency& s) {
  return {MEMBER(kind),          MEMBER(count),          MEMBER(p50_ns),       MEMBER(p99_ns),
          MEMBER(max_ns),        MEMBER(p999_ns),        MEMBER(recent_count), MEMBER(recent_p50_ns),
          MEMBER(recent_p99_ns), MEMBER(recent_p999_ns), MEMBER(recent_max_ns)};
}
template <>
json to_json(const perimap_SetupWatch& s) {
  return {MEMBER(state),
          MEMBER(windows),
          MEMBER(blamed),
          MEMBER(numbers),
          MEMBER(deviations),
          MEMBER(surface_mm),
          MEMBER(surface_deviation_mm),
          MEMBER(widened_mm),
          MEMBER(first_doubted_ns),
          MEMBER(asked)};
}
template <>
json to_json(const perimap_Status& s) {
  return {MEMBER(source),
          MEMBER(stream),
          MEMBER(sample_sequence),
          MEMBER(time_ns),
          MEMBER(version),
          MEMBER(realtime_priority),
          MEMBER(memory_locked),
          MEMBER(latency_ns),
          MEMBER(frames),
          MEMBER(frames_too_late),
          MEMBER(frames_without_pose),
          MEMBER(frames_without_phase),
          MEMBER(samples),
          MEMBER(samples_without_frame),
          MEMBER(samples_from_late_update),
          MEMBER(learning_put_off),
          MEMBER(adoptions_late),
          MEMBER(features_tracked),
          MEMBER(features_starting),
          MEMBER(features_converging),
          MEMBER(features_converged),
          MEMBER(features_inconsistent),
          MEMBER(features_lost),
          MEMBER(sources),
          MEMBER(stages),
          MEMBER(features_started_anew),
          MEMBER(phases_from_image),
          MEMBER(respiration),
          MEMBER(respiration_suspected),
          MEMBER(recording),
          MEMBER(messages_recorded),
          MEMBER(frames_not_recorded),
          MEMBER(other_not_recorded),
          MEMBER(phase_state),
          MEMBER(rhythm),
          MEMBER(latency_short),
          MEMBER(recent_ns),
          MEMBER(respiration_source),
          MEMBER(releases_missed),
          MEMBER(features_shed),
          MEMBER(times_shed),
          MEMBER(features_lost_unseen),
          MEMBER(features_lost_refused),
          MEMBER(features_lost_unstarted),
          MEMBER(starts_failed_unusable),
          MEMBER(starts_failed_behind),
          MEMBER(starts_failed_diverged),
          MEMBER(starts_failed_outliers),
          MEMBER(start_matches_needed),
          MEMBER(start_matches_most),
          MEMBER(start_matches_mean),
          MEMBER(releases_late),
          MEMBER(setup),
          MEMBER(poses_repeated),
          MEMBER(frames_repeated),
          MEMBER(scope_turn),
          MEMBER(scope_rotation_rad),
          MEMBER(scope_turns),
          MEMBER(scope_frames_unread),
          MEMBER(ecg_first_lead),
          MEMBER(ecg_second_lead),
          MEMBER(run_id),
          MEMBER(two_publishers),
          MEMBER(keys_expire_utc_ns),
          MEMBER(displaced_mm),
          MEMBER(displaced_cause),
          MEMBER(times_displaced),
          MEMBER(maps_moved),
          MEMBER(ecg_samples_repeated)};
}
template <>
json to_json(const perimap_TrackerPose& s) {
  return {MEMBER(source_time_ns),    MEMBER(device_frame),     MEMBER(state),
          MEMBER(translation_WS_mm), MEMBER(rotation_WS_wxyz), MEMBER(error_mm)};
}
template <>
json to_json(const perimap_EcgSamples& s) {
  return {MEMBER(first_sample_time_ns), MEMBER(sample_period_ns), MEMBER(device_sequence), MEMBER(lead_off),
          MEMBER(ecg_mV)};
}
template <>
json to_json(const perimap_RTriggerPulse& s) {
  return {MEMBER(edge_time_ns), MEMBER(device_count)};
}
template <>
json to_json(const perimap_RespirationSamples& s) {
  return {MEMBER(first_sample_time_ns), MEMBER(sample_period_ns), MEMBER(device_sequence), MEMBER(sensor_off),
          MEMBER(values)};
}
template <>
json to_json(const perimap_RecordingInfo& s) {
  return {MEMBER(generator), MEMBER(description), MEMBER(utc_minus_monotonic_ns), MEMBER(world_frame_id)};
}
template <>
json to_json(const perimap_TruthMesh& s) {
  return {MEMBER(vertex_count), MEMBER(harmonics), MEMBER(coefficients_W_mm), MEMBER(triangles)};
}
template <>
json to_json(const perimap_TruthMotion& s) {
  return {MEMBER(law),
          MEMBER(r_peak_time_ns),
          MEMBER(systole_fraction),
          MEMBER(systole_offset_s),
          MEMBER(systole_slope_s_per_bpm),
          MEMBER(locked_systole_ns),
          MEMBER(locked_filling_ns),
          MEMBER(locked_systole_phase_rad),
          MEMBER(locked_filling_phase_rad),
          MEMBER(respiration_W_mm),
          MEMBER(respiration_period_ns)};
}
template <>
json to_json(const perimap_TruthCamera& s) {
  return {MEMBER(capture_time_ns), MEMBER(translation_WC_mm),  MEMBER(rotation_WC_wxyz),
          MEMBER(focal_px),        MEMBER(principal_point_px), MEMBER(scope_rotation_rad)};
}
template <>
json to_json(const foxglove_Time& s) {
  return {MEMBER(sec), MEMBER(nsec)};
}
template <>
json to_json(const foxglove_Vector3& s) {
  return {MEMBER(x), MEMBER(y), MEMBER(z)};
}
template <>
json to_json(const foxglove_Quaternion& s) {
  return {MEMBER(x), MEMBER(y), MEMBER(z), MEMBER(w)};
}
template <>
json to_json(const foxglove_Pose& s) {
  return {MEMBER(position), MEMBER(orientation)};
}
template <>
json to_json(const foxglove_PoseInFrame& s) {
  return {MEMBER(timestamp), MEMBER(frame_id), MEMBER(pose)};
}
template <>
json to_json(const foxglove_RawImage& s) {
  return {MEMBER(timestamp), MEMBER(frame_id), MEMBER(width), MEMBER(height),
          MEMBER(encoding),  MEMBER(step),     MEMBER(data)};
}
template <>
json to_json(const foxglove_CompressedImage& s) {
  return {MEMBER(timestamp), MEMBER(frame_id), MEMBER(data), MEMBER(format)};
}

#undef MEMBER

}  // namespace perimap::test

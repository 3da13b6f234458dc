#include "tests/unit/recording/samples.hpp"

#include <cstdio>
#include <string>
#include <type_traits>

namespace perimap::test {
namespace {

using nlohmann::json;

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
          MEMBER(rotation_WC_wxyz)};
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
          MEMBER(cardiac_cycles)};
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
          MEMBER(beats)};
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
          MEMBER(releases_late)};
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
  return {MEMBER(capture_time_ns), MEMBER(translation_WC_mm), MEMBER(rotation_WC_wxyz)};
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

template Sample<perimap_Surface> make_sample(unsigned);
template Sample<perimap_SurfaceModel> make_sample(unsigned);
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
template Sample<foxglove_RawImage> make_sample(unsigned);
template Sample<foxglove_CompressedImage> make_sample(unsigned);
template Sample<foxglove_PoseInFrame> make_sample(unsigned);

}  // namespace perimap::test

#include "daemon/publishing/wire_reports.hpp"

#include <algorithm>

#include "daemon/publishing/wire_surface.hpp"
#include "daemon/publishing/wire_text.hpp"

namespace perimap {
namespace {

perimap_PhaseState to_wire(PhaseState state) noexcept {
  switch (state) {
    case PhaseState::kLocked:
      return perimap_PHASE_LOCKED;
    case PhaseState::kFreeRunning:
      return perimap_PHASE_FREE_RUNNING;
    case PhaseState::kFromImage:
      return perimap_PHASE_FROM_IMAGE;
    case PhaseState::kLost:
      return perimap_PHASE_LOST;
    case PhaseState::kUnknown:
      return perimap_PHASE_UNKNOWN;
  }
  return perimap_PHASE_UNKNOWN;
}

perimap_Rhythm to_wire(Rhythm rhythm) noexcept {
  switch (rhythm) {
    case Rhythm::kPredictable:
      return perimap_RHYTHM_PREDICTABLE;
    case Rhythm::kUnpredictable:
      return perimap_RHYTHM_UNPREDICTABLE;
    case Rhythm::kEctopic:
      return perimap_RHYTHM_ECTOPIC;
    case Rhythm::kUnknown:
      break;
  }
  return perimap_RHYTHM_UNKNOWN;
}

perimap_PhaseLaw to_wire(PhaseLaw law) noexcept {
  switch (law) {
    case PhaseLaw::kLinear:
      return perimap_PHASE_LAW_LINEAR;
    case PhaseLaw::kWarped:
      return perimap_PHASE_LAW_WARPED;
    case PhaseLaw::kTimeLocked:
      return perimap_PHASE_LAW_TIME_LOCKED;
  }
  return perimap_PHASE_LAW_LINEAR;
}

perimap_PhaseClock to_wire(const CardiacClock& clock, Instant now) noexcept {
  const CardiacCycle cycle = clock.cycle_at(now);
  perimap_PhaseClock wire{};
  wire.state = to_wire(clock.at(now).state);
  wire.law = to_wire(clock.law().law);
  wire.anchor_time_ns = to_ns(cycle.begin);
  wire.anchor_deviation_ns = cycle.begin_deviation.count();
  wire.length_ns = cycle.length.count();
  wire.length_deviation_ns = cycle.length_deviation.count();
  wire.systole_ns = cycle.systole.count();
  wire.systole_fraction = clock.law().systole_fraction;
  const LockedParts locked = locked_parts(clock.law(), Seconds(cycle.length));
  wire.locked_systole_ns = from_seconds(locked.systole.count()).count();
  wire.locked_filling_ns = from_seconds(locked.filling.count()).count();
  wire.locked_systole_phase_rad = clock.law().locked_systole_phase_rad;
  wire.locked_filling_phase_rad = clock.law().locked_filling_phase_rad;
  return wire;
}

perimap_RespirationState to_wire(RespirationState state) noexcept {
  switch (state) {
    case RespirationState::kSearching:
      return perimap_RESPIRATION_SEARCHING;
    case RespirationState::kLocked:
      return perimap_RESPIRATION_LOCKED;
    case RespirationState::kOff:
      break;
  }
  return perimap_RESPIRATION_OFF;
}

perimap_RespiratoryClock to_wire(const RespiratoryClock& clock, Instant now) noexcept {
  const RespiratoryPhase phase = clock.at(now);
  perimap_RespiratoryClock wire{};
  wire.state = to_wire(clock.state);
  wire.length_ns = clock.period().count();
  if (phase.known) wire.anchor_time_ns = to_ns(now - from_seconds(phase.phase_rad / phase.rate_rad_per_s));
  wire.deviation_mm = phase.deviation_mm;
  return wire;
}

template <class Message>
void name(Message& message, const Identity& identity) noexcept {
  copy_text(identity.source, message.source);
  copy_text(identity.stream, message.stream);
}

perimap_SourceStatus source_status(perimap_SourceKind kind, const StatusFacts& facts, const SourceLink& link,
                                   Instant now, std::uint64_t received, std::uint64_t dropped, std::uint64_t invalid,
                                   const Counter& last_ns, const LatencyHistogram& delay) noexcept {
  const LatencyHistogram::Summary summary = delay.summary();
  const auto last = static_cast<std::int64_t>(last_ns.get());
  perimap_SourceStatus wire{};
  wire.kind = kind;
  wire.state = perimap_SOURCE_OK;
  if (link.closed) {
    wire.state = perimap_SOURCE_CLOSED;
  } else if (received == 0) {
    wire.state = perimap_SOURCE_STARTING;
  } else if (facts.sources_ended) {
    wire.state = perimap_SOURCE_ENDED;
  } else if (now - from_ns(last) > facts.stalled_after) {
    wire.state = perimap_SOURCE_STALLED;
  }
  wire.received = received;
  wire.dropped = dropped;
  wire.invalid = invalid;
  wire.last_source_time_ns = last;
  wire.delay_p50_ns = summary.p50.count();
  wire.delay_max_ns = summary.max.count();
  wire.jitter_p50_ns = link.jitter_p50.count();
  wire.jitter_p99_ns = link.jitter_p99.count();
  return wire;
}

perimap_StageLatency stage_latency(perimap_StageKind kind, const LatencyHistogram& histogram) noexcept {
  const LatencyHistogram::Summary summary = histogram.summary();
  return {kind, summary.count, summary.p50.count(), summary.p99.count(), summary.max.count()};
}

}  // namespace

WireModel::WireModel(const Identity& identity) {
  name(wire_, identity);
  copy_text(identity.frame_id, wire_.frame_id);
}

const perimap_SurfaceModel& WireModel::fill(std::span<const ShardSnapshot* const> snapshots, const BasisLayout& layout,
                                            const CardiacClock& clock, const RespiratoryClock& respiration,
                                            Instant now) {
  std::vector<const FeatureSnapshot*> order;
  for (const ShardSnapshot* snapshot : snapshots) {
    for (const FeatureSnapshot& feature : snapshot->features) order.push_back(&feature);
  }
  std::sort(order.begin(), order.end(), [](const auto* a, const auto* b) { return a->id < b->id; });

  features_.resize(order.size());
  coefficients_.resize(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const FeatureSnapshot& feature = *order[i];
    coefficients_[i].assign(feature.x.data(), feature.x.data() + feature.x.size());
    perimap_ModelFeature& out = features_[i];
    out.id = feature.id;
    out.state = perimap::to_wire(feature.state);
    out.reason = perimap::to_wire(feature.reason);
    out.first_observed_time_ns = to_ns(feature.first_observed);
    out.first_observed_px[0] = feature.first_observed_px.x();
    out.first_observed_px[1] = feature.first_observed_px.y();
    out.largest_deviation_mm = feature.largest_deviation_mm;
    const auto n = static_cast<std::uint32_t>(coefficients_[i].size());
    out.coefficients_W_mm = {n, n, coefficients_[i].data(), false};
  }
  ++wire_.sample_sequence;
  wire_.time_ns = to_ns(now);
  wire_.cardiac_harmonics = static_cast<std::uint32_t>(layout.cardiac_harmonics);
  wire_.respiratory_harmonics = static_cast<std::uint32_t>(layout.respiratory_harmonics);
  wire_.cardiac_clock = to_wire(clock, now);
  wire_.respiratory_clock = to_wire(respiration, now);
  const auto n = static_cast<std::uint32_t>(features_.size());
  wire_.features = {n, n, features_.data(), false};
  return wire_;
}

WirePhase::WirePhase(const Identity& identity) { name(wire_, identity); }

const perimap_Phase& WirePhase::fill(const CardiacClock& clock, Instant now) noexcept {
  const PhaseEstimate phase = clock.at(now);
  ++wire_.sample_sequence;
  wire_.time_ns = to_ns(now);
  wire_.state = to_wire(phase.state);
  wire_.cardiac_phase_rad = phase.phase_rad;
  wire_.cardiac_phase_deviation_rad = phase.deviation_s * phase.rate_rad_per_s;
  wire_.cardiac_phase_rate_rad_per_s = phase.rate_rad_per_s;
  wire_.last_r_peak_time_ns = to_ns(clock.anchor());
  wire_.predicted_r_peak_time_ns = to_ns(clock.predicted_r_peak());
  wire_.predicted_r_peak_deviation_ns = clock.predicted_r_peak_deviation().count();
  wire_.beats = clock.beats();
  return wire_;
}

WireStatus::WireStatus(const Identity& identity) {
  name(wire_, identity);
  copy_text(PERIMAP_VERSION, wire_.version);
}

const perimap_Status& WireStatus::fill(const PipelineCounters& c, const StatusFacts& facts, Instant now) noexcept {
  ++wire_.sample_sequence;
  wire_.time_ns = to_ns(now);
  wire_.realtime_priority = facts.realtime_priority;
  wire_.memory_locked = facts.memory_locked;
  wire_.latency_ns = facts.latency.count();
  wire_.frames = c.frames.get();
  wire_.frames_too_late = c.frames_too_late.get();
  wire_.frames_without_pose = c.frames_without_pose.get();
  wire_.frames_without_phase = c.frames_without_phase.get();
  wire_.phases_from_image = c.phases_from_image.get();
  wire_.samples = c.samples.get();
  wire_.samples_without_frame = c.samples_without_frame.get();
  wire_.samples_from_late_update = c.samples_from_late_update.get();
  wire_.learning_put_off = c.learning_put_off.get();
  wire_.adoptions_late = c.adoptions_late.get();
  wire_.features_tracked = static_cast<std::uint32_t>(c.features_tracked.get());
  wire_.features_starting = static_cast<std::uint32_t>(c.features_starting.get());
  wire_.features_converging = static_cast<std::uint32_t>(c.features_converging.get());
  wire_.features_converged = static_cast<std::uint32_t>(c.features_converged.get());
  wire_.features_inconsistent = static_cast<std::uint32_t>(c.features_inconsistent.get());
  wire_.features_lost = c.features_lost.get();
  wire_.respiration = to_wire(facts.respiration);
  wire_.respiration_suspected = facts.respiration_suspected;
  wire_.features_started_anew = c.features_started_anew.get();
  wire_.recording = facts.recording.state;
  wire_.messages_recorded = facts.recording.recorded;
  wire_.frames_not_recorded = facts.recording.frames_not_recorded;
  wire_.other_not_recorded = facts.recording.other_not_recorded;
  wire_.phase_state = to_wire(facts.phase);
  wire_.rhythm = to_wire(facts.rhythm);

  sources_[0] = source_status(perimap_SOURCE_CAMERA, facts, facts.camera, now, c.frames_received.get(),
                              c.frames_dropped.get(), 0, c.last_frame_ns, c.camera_delay);
  sources_[1] = source_status(perimap_SOURCE_TRACKER, facts, facts.tracker, now, c.poses_received.get(),
                              c.poses_dropped.get() + c.poses_refused.get(), c.poses_invalid.get(), c.last_pose_ns,
                              c.tracker_delay);
  sources_[2] = source_status(perimap_SOURCE_ECG, facts, facts.ecg, now, c.ecg_samples.get(), c.ecg_dropped.get(),
                              c.ecg_lead_off.get(), c.last_ecg_ns, c.ecg_delay);
  std::uint32_t sources = kSources - 1;
  if (facts.r_trigger) {
    sources_[sources++] = source_status(perimap_SOURCE_R_TRIGGER, facts, {}, now, c.r_triggers.get(),
                                        c.r_triggers_dropped.get(), 0, c.last_r_trigger_ns, c.r_trigger_delay);
  }
  wire_.sources = {sources, sources, sources_, false};

  stages_[0] = stage_latency(perimap_STAGE_PREDICT_AND_FIND, c.predict_and_find);
  stages_[1] = stage_latency(perimap_STAGE_PHASE_AND_POSE, c.phase_and_pose);
  stages_[2] = stage_latency(perimap_STAGE_EVALUATE, c.evaluate);
  stages_[3] = stage_latency(perimap_STAGE_LEARN, c.learn);
  stages_[4] = stage_latency(perimap_STAGE_CAPTURE_TO_UPDATE, c.capture_to_update);
  stages_[5] = stage_latency(perimap_STAGE_RELEASE_TARDINESS, c.release_tardiness);
  stages_[6] = stage_latency(perimap_STAGE_DDS_WRITE, c.dds_write);
  wire_.stages = {kStages, kStages, stages_, false};
  return wire_;
}

}  // namespace perimap

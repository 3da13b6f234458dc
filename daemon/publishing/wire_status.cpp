#include "daemon/publishing/wire_status.hpp"

#include <algorithm>
#include <optional>

#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/publishing/wire_states.hpp"
#include "daemon/publishing/wire_text.hpp"

namespace perimap {
namespace {

// A trigger gives one pulse a beat.
constexpr Duration kLongestBeat = std::chrono::seconds(3);

// What is known of one source.
struct SourceFacts {
  perimap_SourceKind kind;
  const SourceLink& link;
  std::uint64_t received = 0;
  std::uint64_t dropped = 0;
  std::uint64_t invalid = 0;
  const Counter& last_ns;
  const Counter& last_good_ns;
  const LatencyHistogram& delay;
  Duration stalled_after;  // silent for longer, it counts as stalled
};

// Calls `tell(SourceFacts)` for each source that there is, in the order of kStatusSources.
template <class Tell>
void for_each_source(const PipelineCounters& c, const StatusFacts& facts, Tell tell) noexcept {
  const Duration stalled = facts.stalled_after;
  tell(SourceFacts{perimap_SOURCE_CAMERA, facts.camera, c.frames_received.get(), c.frames_dropped.get(), 0,
                   c.last_frame_ns, c.last_frame_ns, c.camera_delay, stalled});
  tell(SourceFacts{perimap_SOURCE_TRACKER, facts.tracker, c.poses_received.get(),
                   c.poses_dropped.get() + c.poses_refused.get(), c.poses_invalid.get(), c.last_pose_ns,
                   c.last_good_pose_ns, c.tracker_delay, stalled});
  if (facts.ecg_device) {
    tell(SourceFacts{perimap_SOURCE_ECG, facts.ecg, c.ecg_samples.get(), c.ecg_dropped.get(), c.ecg_lead_off.get(),
                     c.last_ecg_ns, c.last_good_ecg_ns, c.ecg_delay, stalled});
  }
  if (facts.r_trigger) {
    tell(SourceFacts{perimap_SOURCE_R_TRIGGER, facts.r_trigger_line, c.r_triggers.get(), c.r_triggers_dropped.get(), 0,
                     c.last_r_trigger_ns, c.last_r_trigger_ns, c.r_trigger_delay, std::max(stalled, kLongestBeat)});
  }
  if (facts.respiration_channel) {
    tell(SourceFacts{perimap_SOURCE_RESPIRATION, facts.respiration_link, c.respiration_samples.get(),
                     c.respiration_dropped.get(), c.respiration_off.get(), c.last_respiration_ns,
                     c.last_good_respiration_ns, c.respiration_delay, stalled});
  }
}

// `ended`: of a recording.
perimap_SourceState state_of(const SourceFacts& source, bool ended, Instant now) noexcept {
  if (source.link.closed) return perimap_SOURCE_CLOSED;
  if (source.received == 0) return perimap_SOURCE_STARTING;
  if (ended) return perimap_SOURCE_ENDED;
  const Instant last = from_ns(static_cast<std::int64_t>(source.last_ns.get()));
  return now - last > source.stalled_after ? perimap_SOURCE_STALLED : perimap_SOURCE_OK;
}

perimap_SourceStatus source_status(const SourceFacts& source, bool ended, Instant now) noexcept {
  const LatencyHistogram::Summary summary = source.delay.summary();
  perimap_SourceStatus wire{};
  wire.kind = source.kind;
  wire.state = state_of(source, ended, now);
  wire.received = source.received;
  wire.dropped = source.dropped;
  wire.invalid = source.invalid;
  wire.last_source_time_ns = static_cast<std::int64_t>(source.last_ns.get());
  wire.last_good_time_ns = static_cast<std::int64_t>(source.last_good_ns.get());
  wire.delay_p50_ns = summary.p50.count();
  wire.delay_p99_ns = summary.p99.count();
  wire.delay_max_ns = summary.max.count();
  wire.jitter_p50_ns = source.link.jitter_p50.count();
  wire.jitter_p99_ns = source.link.jitter_p99.count();
  return wire;
}

// `then`: the counts of some seconds ago; null when they are not known.
perimap_StageLatency stage_latency(perimap_StageKind kind, const LatencyHistogram& histogram,
                                   const LatencyHistogram::Counts* then) noexcept {
  const LatencyHistogram::Summary all = histogram.summary();
  perimap_StageLatency wire{};
  wire.kind = kind;
  wire.count = all.count;
  wire.p50_ns = all.p50.count();
  wire.p99_ns = all.p99.count();
  wire.p999_ns = all.p999.count();
  wire.max_ns = all.max.count();
  if (then == nullptr) return wire;
  const LatencyHistogram::Summary recent = LatencyHistogram::between(*then, histogram.counts());
  wire.recent_count = recent.count;
  wire.recent_p50_ns = recent.p50.count();
  wire.recent_p99_ns = recent.p99.count();
  wire.recent_p999_ns = recent.p999.count();
  wire.recent_max_ns = recent.max.count();
  return wire;
}

perimap_SetupWatch to_wire(const SetupBelief& belief) noexcept {
  const SetupVerdict& told = belief.told();
  const bool doubted = belief.doubted();
  perimap_SetupWatch wire{};
  wire.state = to_wire(told.state);
  wire.windows = belief.judged();
  std::copy(told.blamed.begin(), told.blamed.end(), wire.blamed);
  const SetupVector& numbers = doubted ? told.blamed_deviation : told.deviation;
  const SetupVector& deviations = doubted ? told.blamed_uncertainty : told.uncertainty;
  std::copy(numbers.begin(), numbers.end(), wire.numbers);
  std::copy(deviations.begin(), deviations.end(), wire.deviations);
  // An offset that is greater takes the pose of an earlier reading.
  wire.numbers[kTimeAt] = -wire.numbers[kTimeAt];
  wire.surface_mm = told.surface_mm;
  wire.surface_deviation_mm = told.surface_deviation_mm;
  wire.widened_mm = belief.widening_mm();
  wire.first_doubted_ns = belief.first_doubted().value_or(Duration(0)).count();
  wire.asked = belief.asked();
  return wire;
}

// 1 + EcgSignal, as it is counted; 0: no such lead.
// Of a source of which nothing comes any more, what was heard last says nothing.
perimap_EcgLead ecg_lead(std::uint64_t counted, bool comes) noexcept {
  if (counted == 0) return perimap_ECG_LEAD_NONE;
  return comes ? to_wire(static_cast<EcgSignal>(counted - 1)) : perimap_ECG_LEAD_OFF;
}

}  // namespace

SourceStates source_states(const PipelineCounters& counters, const StatusFacts& facts, Instant now) noexcept {
  SourceStates states;
  states.fill(perimap_SOURCE_STARTING);
  for_each_source(counters, facts, [&](const SourceFacts& source) noexcept {
    for (std::size_t i = 0; i < kStatusSources.size(); ++i) {
      if (kStatusSources[i].kind == source.kind) states[i] = state_of(source, facts.sources_ended, now);
    }
  });
  return states;
}

WireStatus::WireStatus(const Identity& identity) : stream_(identity.stream) {
  name_as(wire_, identity);
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
  const StreamCounters& stream = c.of(stream_);
  wire_.samples = stream.samples.get();
  wire_.samples_without_frame = stream.samples_without_frame.get();
  wire_.samples_from_late_update = stream.samples_from_late_update.get();
  wire_.releases_missed = stream.releases_missed.get();
  wire_.releases_late = stream.releases_late.get();
  wire_.learning_put_off = c.learning_put_off.get();
  wire_.adoptions_late = c.adoptions_late.get();
  wire_.features_tracked = static_cast<std::uint32_t>(c.features_tracked.get());
  wire_.features_starting = static_cast<std::uint32_t>(c.features_starting.get());
  wire_.features_converging = static_cast<std::uint32_t>(c.features_converging.get());
  wire_.features_converged = static_cast<std::uint32_t>(c.features_converged.get());
  wire_.features_inconsistent = static_cast<std::uint32_t>(c.features_inconsistent.get());
  wire_.features_shed = static_cast<std::uint32_t>(c.features_shed.get());
  wire_.times_shed = c.times_shed.get();
  wire_.features_lost = c.features_lost();
  wire_.features_lost_unseen = c.features_lost_unseen.get();
  wire_.features_lost_refused = c.features_lost_refused.get();
  wire_.features_lost_unstarted = c.features_lost_unstarted.get();
  wire_.starts_failed_unusable =
      c.starts_failed_by(BatchStatus::kTooFewObservations) + c.starts_failed_by(BatchStatus::kBadObservation);
  wire_.starts_failed_behind = c.starts_failed_by(BatchStatus::kBehindCamera);
  wire_.starts_failed_diverged = c.starts_failed_by(BatchStatus::kDiverged);
  wire_.starts_failed_outliers = c.starts_failed_by(BatchStatus::kTooManyOutliers);
  wire_.start_matches_needed = static_cast<std::uint32_t>(c.start_matches_needed.get());
  wire_.start_matches_most = static_cast<std::uint32_t>(c.start_matches_most.get());
  wire_.start_matches_mean = static_cast<std::uint32_t>(c.start_matches_mean.get());
  wire_.respiration = to_wire(facts.respiration);
  wire_.respiration_suspected = facts.respiration_suspected;
  wire_.respiration_source = to_wire(facts.respiration_source);
  wire_.features_started_anew = c.features_started_anew.get();
  wire_.recording = facts.recording.state;
  wire_.messages_recorded = facts.recording.recorded;
  wire_.frames_not_recorded = facts.recording.frames_not_recorded;
  wire_.other_not_recorded = facts.recording.other_not_recorded;
  wire_.phase_state = to_wire(facts.phase);
  wire_.rhythm = to_wire(facts.rhythm);
  wire_.latency_short = facts.latency_short;
  wire_.two_publishers = facts.two_publishers;
  wire_.keys_expire_utc_ns = facts.keys_expire_utc_ns;
  wire_.displaced_mm = c.displaced.get() != 0 ? 1e-3 * static_cast<double>(c.displaced_um.get()) : 0.0;
  wire_.displaced_cause = to_wire(static_cast<DisplacedCause>(c.displaced_cause.get()));
  wire_.times_displaced = c.times_displaced.get();
  wire_.maps_moved = c.maps_moved.get();
  wire_.ecg_samples_repeated = c.ecg_repeated.get();
  wire_.setup = to_wire(facts.setup);
  wire_.poses_repeated = c.poses_repeated.get();
  wire_.frames_repeated = c.frames_repeated.get();
  wire_.scope_turn = c.scope_changed.get() != 0 ? perimap_SCOPE_TURN_CHANGED
                     : c.scope_read.get() != 0  ? perimap_SCOPE_TURN_READ
                                                : perimap_SCOPE_TURN_UNREAD;
  wire_.scope_rotation_rad = 1e-6 * static_cast<double>(c.scope_rotation_urad.get());
  wire_.scope_turns = c.scope_turns.get();
  wire_.scope_frames_unread = c.scope_frames_unread.get();

  std::uint32_t sources = 0;
  bool ecg_comes = false;
  for_each_source(c, facts, [&](const SourceFacts& source) noexcept {
    const perimap_SourceStatus& told = sources_[sources++] = source_status(source, facts.sources_ended, now);
    if (source.kind == perimap_SOURCE_ECG) ecg_comes = told.state == perimap_SOURCE_OK;
  });
  wire_.ecg_first_lead = ecg_lead(c.ecg_leads[0].get(), ecg_comes);
  wire_.ecg_second_lead = ecg_lead(c.ecg_leads[1].get(), ecg_comes);
  wire_.sources = {sources, sources, sources_, false};

  const std::optional<CountsThen> then = facts.recent != nullptr ? facts.recent->then() : std::nullopt;
  wire_.recent_ns = then ? (now - then->time).count() : 0;
  for (std::uint32_t i = 0; i < sources; ++i) {
    if (then && now > then->time) {
      sources_[i].rate_hz = static_cast<double>(sources_[i].received - then->received_of(sources_[i].kind)) /
                            to_seconds(now - then->time);
    }
  }
  for (std::size_t i = 0; i < kStatusStages.size(); ++i) {
    stages_[i] = stage_latency(kStatusStages[i], stage_histogram(c, stream_, kStatusStages[i]),
                               then ? &then->stages[index_of(stream_)][i] : nullptr);
  }
  constexpr auto kStages = static_cast<std::uint32_t>(kStatusStages.size());
  wire_.stages = {kStages, kStages, stages_, false};
  return wire_;
}

std::vector<WireStatus> wire_statuses(const Identity& identity, const PipelineSettings& settings) {
  std::vector<WireStatus> statuses;
  for (const ReleaseStream stream : kReleaseStreams) {
    if (publishes(settings, stream)) statuses.emplace_back(identity.of(stream));
  }
  return statuses;
}

}  // namespace perimap

#include "daemon/publishing/wire_reports.hpp"

#include <algorithm>
#include <optional>

#include "daemon/publishing/wire_surface.hpp"
#include "daemon/publishing/wire_text.hpp"

namespace perimap {
namespace {

// So far back a subscriber may still evaluate, to draw over a frame that was captured before the model was made.
constexpr Duration kModelPast = std::chrono::seconds(1);

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
  const LawBelief& belief = clock.law_belief();
  std::copy(belief.probabilities.begin(), belief.probabilities.end(), wire.law_probabilities);
  return wire;
}

perimap_RespiratoryClock to_wire(const RespiratoryClock& clock, Instant now) noexcept {
  const RespiratoryPhase phase = clock.at(now);
  perimap_RespiratoryClock wire{};
  wire.state = to_wire(clock.state);
  wire.length_ns = clock.period().count();
  if (phase.known) wire.anchor_time_ns = to_ns(now - from_seconds(phase.phase_rad / phase.rate_rad_per_s));
  wire.deviation_mm = phase.deviation_mm;
  if (clock.state == RespirationState::kLocked) {
    const double dt = to_seconds(now - clock.time);
    wire.slope_mm_per_rad = clock.slope_mm_per_rad;
    wire.phase_variance_rad2 =
        clock.phase_variance_rad2 + dt * (2.0 * clock.covariance_rad2_per_s + dt * clock.rate_variance_rad2_per_s2);
    wire.phase_rate_covariance_rad2_per_s = clock.covariance_rad2_per_s + dt * clock.rate_variance_rad2_per_s2;
    wire.rate_variance_rad2_per_s2 = clock.rate_variance_rad2_per_s2;
  }
  return wire;
}

perimap_CardiacCycle to_wire(const CardiacCycle& cycle, const PhaseLawSettings& law) noexcept {
  const LockedParts locked = locked_parts(law, Seconds(cycle.length));
  perimap_CardiacCycle wire{};
  wire.measured = cycle.completed;
  wire.stretches = stretches(law, cycle.length, cycle.previous_length);
  wire.begin_time_ns = to_ns(cycle.begin);
  wire.begin_deviation_ns = cycle.begin_deviation.count();
  wire.length_ns = cycle.length.count();
  wire.length_deviation_ns = cycle.length_deviation.count();
  wire.irregularity_ns = cycle.irregularity.count();
  wire.systole_ns = cycle.systole.count();
  wire.locked_systole_ns = from_seconds(locked.systole.count()).count();
  wire.locked_filling_ns = from_seconds(locked.filling.count()).count();
  wire.systole_slope = systole_slope(law, cycle.length, cycle.previous_length);
  wire.previous_length_deviation_ns = cycle.previous_length_deviation.count();
  return wire;
}

template <class Message>
void name(Message& message, const Identity& identity) noexcept {
  copy_text(identity.source, message.source);
  copy_text(name_of(identity.stream), message.stream);
}

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

}  // namespace

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

perimap_RespirationSource to_wire(RespirationSource source) noexcept {
  switch (source) {
    case RespirationSource::kImage:
      return perimap_RESPIRATION_SOURCE_IMAGE;
    case RespirationSource::kChannel:
      return perimap_RESPIRATION_SOURCE_CHANNEL;
    case RespirationSource::kNone:
      break;
  }
  return perimap_RESPIRATION_SOURCE_NONE;
}

WireModel::WireModel(const Identity& identity) {
  name(wire_, identity);
  copy_text(identity.frame_id, wire_.frame_id);
}

const perimap_SurfaceModel& WireModel::fill(const ModelMoment& moment) {
  const PhaseEstimate phase = moment.clock.at(moment.now);
  const SurfaceReason reason = reason_of(phase, moment.clock.rhythm(), moment.footing);
  ++wire_.sample_sequence;
  wire_.time_ns = to_ns(moment.now);
  wire_.time_utc_ns = to_ns(moment.now + moment.utc_minus_monotonic);
  wire_.state = perimap::to_wire(state_of(reason));
  wire_.reason = perimap::to_wire(reason);
  wire_.cardiac_harmonics = static_cast<std::uint32_t>(moment.layout.cardiac_harmonics);
  wire_.respiratory_harmonics = static_cast<std::uint32_t>(moment.layout.respiratory_harmonics);
  wire_.cardiac_clock = to_wire(moment.clock, moment.now);
  wire_.respiratory_clock = to_wire(moment.respiration, moment.now);
  fill_features(moment);
  fill_cycles(moment);
  return wire_;
}

// As SurfaceComposer has them, but for the covariance, which the workers evaluate for the surfaces alone.
void WireModel::fill_features(const ModelMoment& moment) {
  std::vector<const FeatureSnapshot*> order;
  for (const ShardSnapshot* snapshot : moment.snapshots) {
    for (const FeatureSnapshot& feature : snapshot->features) order.push_back(&feature);
  }
  std::sort(order.begin(), order.end(), [](const auto* a, const auto* b) { return a->id < b->id; });

  const PhaseState phase = moment.clock.at(moment.now).state;
  features_.resize(order.size());
  coefficients_.resize(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const FeatureSnapshot& feature = *order[i];
    const FeatureVerdict verdict = verdict_of({feature.state, feature.reason}, phase, moment.footing);
    coefficients_[i].assign(feature.x.data(), feature.x.data() + feature.x.size());
    perimap_ModelFeature& out = features_[i];
    out.id = feature.id;
    out.state = perimap::to_wire(verdict.state);
    out.reason = perimap::to_wire(verdict.reason);
    out.first_observed_time_ns = to_ns(feature.first_observed);
    out.first_observed_px[0] = feature.first_observed_px.x();
    out.first_observed_px[1] = feature.first_observed_px.y();
    out.largest_deviation_mm = feature.largest_deviation_mm;
    const auto n = static_cast<std::uint32_t>(coefficients_[i].size());
    out.coefficients_W_mm = {n, n, coefficients_[i].data(), false};
    out.last_observed_time_ns = to_ns(feature.last_observed);
  }
  const auto n = static_cast<std::uint32_t>(features_.size());
  wire_.features = {n, n, features_.data(), false};
}

void WireModel::fill_cycles(const ModelMoment& moment) {
  const CardiacClock& clock = moment.clock;
  wire_.valid_from_ns = wire_.expected_until_ns = wire_.valid_until_ns = to_ns(moment.now);
  cycles_.clear();
  CardiacCycle cycle = clock.cycle_at(moment.now);
  if (cycle.length > Duration(0)) {
    while (cycle.begin > moment.now - kModelPast) {
      const CardiacCycle before = clock.cycle_at(cycle.begin - Duration(1));
      if (before.length <= Duration(0) || before.begin + before.length != cycle.begin) break;
      cycle = before;
    }
    wire_.valid_from_ns = to_ns(cycle.begin);
    wire_.expected_until_ns = to_ns(clock.expected_until());
    const Instant valid_until = std::min(moment.now + moment.validity, clock.lost_from());
    wire_.valid_until_ns = to_ns(valid_until);
    while (cycle.length > Duration(0) && cycle.begin <= valid_until) {
      cycles_.push_back(to_wire(cycle, clock.law()));
      cycle = clock.cycle_at(cycle.begin + cycle.length);
    }
  }
  const auto n = static_cast<std::uint32_t>(cycles_.size());
  wire_.cardiac_cycles = {n, n, cycles_.data(), false};
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

  std::uint32_t sources = 0;
  for_each_source(c, facts, [&](const SourceFacts& source) noexcept {
    sources_[sources++] = source_status(source, facts.sources_ended, now);
  });
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

#include "daemon/evaluation/session/published_session.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "daemon/publishing/setup_text.hpp"
#include "daemon/publishing/wire_names.hpp"

namespace perimap {
namespace {

std::string words(std::string_view name) {
  std::string text(name);
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

Tone tone_of(perimap_SurfaceState state) {
  switch (state) {
    case perimap_SURFACE_GOOD:
      return Tone::kWell;
    case perimap_SURFACE_DEGRADED:
      return Tone::kDoubtful;
    case perimap_SURFACE_INVALID:
      break;
  }
  return Tone::kBad;
}

Tone tone_of(perimap_PhaseState state) {
  switch (state) {
    case perimap_PHASE_LOCKED:
      return Tone::kWell;
    case perimap_PHASE_FREE_RUNNING:
    case perimap_PHASE_FROM_IMAGE:
      return Tone::kDoubtful;
    case perimap_PHASE_UNKNOWN:
    case perimap_PHASE_LOST:
      break;
  }
  return Tone::kBad;
}

Tone tone_of(perimap_SourceState state) {
  switch (state) {
    case perimap_SOURCE_OK:
      return Tone::kWell;
    case perimap_SOURCE_STARTING:
      return Tone::kDoubtful;
    case perimap_SOURCE_ENDED:
      return Tone::kNeutral;
    case perimap_SOURCE_STALLED:
    case perimap_SOURCE_CLOSED:
      break;
  }
  return Tone::kBad;
}

Tone tone_of(perimap_EcgLead lead) {
  switch (lead) {
    case perimap_ECG_LEAD_GOOD:
      return Tone::kWell;
    case perimap_ECG_LEAD_LEARNING:
    case perimap_ECG_LEAD_NOISY:
      return Tone::kDoubtful;
    case perimap_ECG_LEAD_NONE:
    case perimap_ECG_LEAD_FLAT:
    case perimap_ECG_LEAD_OFF:
    case perimap_ECG_LEAD_REPEATED:
      break;
  }
  return Tone::kBad;
}

Tone tone_of(perimap_SetupState state) {
  switch (state) {
    case perimap_SETUP_CONSISTENT:
      return Tone::kWell;
    case perimap_SETUP_UNKNOWN:
    case perimap_SETUP_UNDETERMINED:
      return Tone::kNeutral;
    case perimap_SETUP_DOUBTED:
      break;
  }
  return Tone::kBad;
}

Tone tone_of(perimap_RecordingState state) {
  if (state == perimap_RECORDING_ON) return Tone::kWell;
  return state == perimap_RECORDING_OFF ? Tone::kNeutral : Tone::kBad;
}

double seconds_of(Instant instant) { return to_seconds(instant.time_since_epoch()); }

double seconds_of(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

// For how long from its receipt on the surface may be used. Where the receiver's clock is another than the publisher's,
// by the publisher's times alone.
double holds_s(const perimap_Surface& surface, double receipt_s) {
  constexpr double kSameClock_s = 10.0;
  const double release_s = seconds_of(surface.release_time_ns);
  const bool same_clock = std::abs(receipt_s - release_s) < kSameClock_s;
  return seconds_of(surface.valid_until_ns) - (same_clock ? receipt_s : release_s);
}

StatusCounters counters_of(const perimap_Status& status) {
  StatusCounters counters;
  std::copy_n(status.run_id, counters.run_id.size(), counters.run_id.begin());
  counters.counts = {status.samples_from_late_update,
                     status.releases_missed,
                     status.releases_late,
                     status.frames_without_pose,
                     status.frames_without_phase,
                     status.frames_not_recorded + status.other_not_recorded,
                     status.samples};
  for (std::uint32_t i = 0; i < status.sources._length; ++i) {
    const perimap_SourceStatus& source = status.sources._buffer[i];
    counters.sources[source.kind] = {source.received, source.dropped};
  }
  return counters;
}

// What came after `before`: all of it where perimapd began anew.
std::uint64_t since(std::uint64_t now, std::uint64_t before) { return now >= before ? now - before : now; }

}  // namespace

double PublishedSession::Interval::holds_s(double at_s) noexcept {
  constexpr double kLeast_s = 1.0, kIntervals = 2.5;
  const double interval_s = last_s_ >= 0.0 ? std::max(at_s - last_s_, kLeast_s) : kLeast_s;
  last_s_ = at_s;
  return kIntervals * interval_s;
}

void PublishedSession::add(const perimap_Surface& surface, const SurfaceDigest& brief, Instant receipt) {
  const double at_s = seconds_of(receipt);
  if (surfaces_.empty()) {
    begin_s_ = at_s;
    begin_utc_ns_ = surface.release_utc_ns;
  }
  std::string what = words(name_of(surface.state));
  if (surface.reason != perimap_SURFACE_REASON_NONE) what += ": " + words(name_of(surface.reason));
  const double holds = holds_s(surface, at_s);
  // What must not be used any more when it comes is not good, whatever it says.
  if (!(holds > 0.0)) what = "received too late";
  reasons_.emplace(what, holds > 0.0 ? surface.reason : perimap_SURFACE_REASON_NONE);
  surface_.say(at_s, what, holds > 0.0 ? tone_of(surface.state) : Tone::kBad, holds);
  if (surface.state == perimap_SURFACE_GOOD && holds > 0.0 && !first_good_s_) first_good_s_ = at_s - begin_s_;
  virtual_time_ = virtual_time_ && to_ns(receipt) == surface.release_time_ns;

  SurfaceMoment moment;
  moment.at_s = at_s - begin_s_;
  moment.converged = brief.features[perimap_FEATURE_CONVERGED];
  moment.others = brief.features[perimap_FEATURE_CONVERGING] + brief.features[perimap_FEATURE_INCONSISTENT];
  moment.deviation_mm = brief.median_deviation_mm;
  moment.capture_to_receipt_ms = 1e3 * (at_s - seconds_of(surface.capture_time_ns));
  surfaces_.push_back(moment);
}

void PublishedSession::add(const perimap_Phase& phase, Instant receipt) {
  const double at_s = seconds_of(receipt);
  phase_.say(at_s, words(name_of(phase.state)), tone_of(phase.state), phases_.holds_s(at_s));
  // Of two beats between samples the interval is not known.
  if (phase.beats == last_beats_) return;
  if (phase.beats == last_beats_ + 1 && last_r_peak_ns_ != 0 && phase.last_r_peak_time_ns > last_r_peak_ns_) {
    rhythm_.push_back({at_s, seconds_of(phase.last_r_peak_time_ns) - seconds_of(last_r_peak_ns_)});
  }
  last_beats_ = phase.beats;
  last_r_peak_ns_ = phase.last_r_peak_time_ns;
}

void PublishedSession::add(const perimap_Status& status, Instant receipt) {
  const double at_s = seconds_of(receipt);
  const double holds = statuses_.holds_s(at_s);
  const auto say = [at_s, holds](SessionStrip& strip, auto state) {
    strip.say(at_s, words(name_of(state)), tone_of(state), holds);
  };
  say(set_up_, status.setup.state);
  say(recording_, status.recording);
  if (status.ecg_first_lead != perimap_ECG_LEAD_NONE) say(lead_, status.ecg_first_lead);
  if (status.ecg_second_lead != perimap_ECG_LEAD_NONE) say(second_lead_, status.ecg_second_lead);
  for (std::uint32_t i = 0; i < status.sources._length; ++i) {
    const perimap_SourceStatus& source = status.sources._buffer[i];
    say(sources_.try_emplace(source.kind, words(name_of(source.kind))).first->second, source.state);
  }
  count(status);
}

void PublishedSession::count(const perimap_Status& status) {
  const StatusCounters now = counters_of(status);
  counters_.latency_short |= status.latency_short;
  counters_.respiration_suspected |= status.respiration_suspected;
  counters_.recording_stopped |= status.recording == perimap_RECORDING_STOPPED;
  counters_.priority_refused |= status.realtime_priority == perimap_PRIVILEGE_REFUSED;
  counters_.memory_refused |= status.memory_locked == perimap_PRIVILEGE_REFUSED;
  if (status.setup.state == perimap_SETUP_DOUBTED) counters_.doubt = setup_words(status.setup);
  if (last_counters_) {
    const bool another_run = now.run_id != last_counters_->run_id;
    const StatusCounters before = another_run ? StatusCounters{} : *last_counters_;
    for (std::size_t i = 0; i < now.counts.size(); ++i) counters_.counts[i] += since(now.counts[i], before.counts[i]);
    for (const auto& [kind, source] : now.sources) {
      const auto known = before.sources.find(kind);
      const SourceCounters last = known != before.sources.end() ? known->second : SourceCounters{};
      counters_.sources[kind].received += since(source.received, last.received);
      counters_.sources[kind].lost += since(source.lost, last.lost);
    }
  }
  last_counters_ = now;
}

SessionRecord PublishedSession::record() const {
  SessionRecord record;
  record.begin_utc_ns = begin_utc_ns_;
  record.length_s = surfaces_.empty() ? 0.0 : surfaces_.back().at_s;
  record.first_good_s = first_good_s_;
  record.surfaces = surfaces_;
  record.virtual_time = virtual_time_;
  record.counters = counters_;
  for (RhythmMoment moment : rhythm_) {
    moment.at_s -= begin_s_;
    if (moment.at_s >= 0.0) record.rhythm.push_back(moment);
  }
  const auto show = [this, &record](SessionStrip strip) {
    strip.end(begin_s_ + record.length_s);
    record.strips.push_back(strip.from(begin_s_));
  };
  show(surface_);
  show(phase_);
  for (const auto& [kind, strip] : sources_) show(strip);
  for (const SessionStrip* strip : {&lead_, &second_lead_, &set_up_, &recording_}) show(*strip);
  for (const SessionSpan& span : record.strips.front().spans()) {
    auto share = std::find_if(record.shares.begin(), record.shares.end(),
                              [&span](const StateShare& known) { return known.what == span.what; });
    if (share == record.shares.end()) {
      record.shares.push_back({span.what, span.tone, reasons_.at(span.what), 0.0, 0, -1.0, 0.0});
      share = record.shares.end() - 1;
    }
    share->seconds += span.length_s();
    ++share->spans;
    if (span.length_s() > share->longest_s) {
      share->longest_s = span.length_s();
      share->longest_begin_s = span.begin_s;
    }
  }
  std::stable_sort(record.shares.begin(), record.shares.end(),
                   [](const StateShare& a, const StateShare& b) { return a.seconds > b.seconds; });
  return record;
}

}  // namespace perimap

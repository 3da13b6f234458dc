#include "daemon/evaluation/session/published_session.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

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

// Of what was said before the first surface nothing is kept.
SessionStrip moved(const SessionStrip& strip, double begin_s) {
  SessionStrip from_begin(strip.name(), 0.0);
  for (const SessionSpan& span : strip.spans()) {
    if (span.end_s < begin_s) continue;
    from_begin.say(std::max(span.begin_s - begin_s, 0.0), span.what, span.tone);
    from_begin.prolong(span.end_s - begin_s);
  }
  return from_begin;
}

}  // namespace

void PublishedSession::add(const perimap_Surface& surface, Instant receipt) {
  const double at_s = seconds_of(receipt);
  if (surfaces_.empty()) {
    begin_s_ = at_s;
    begin_utc_ns_ = surface.release_utc_ns;
  }
  std::string what = words(name_of(surface.state));
  if (surface.reason != perimap_SURFACE_REASON_NONE) what += ": " + words(name_of(surface.reason));
  reasons_.emplace(what, surface.reason);
  surface_.say(at_s, what, tone_of(surface.state));
  if (surface.state == perimap_SURFACE_GOOD && !first_good_s_) first_good_s_ = at_s - begin_s_;

  const SurfaceDigest brief = digest(surface);
  SurfaceMoment moment;
  moment.at_s = at_s - begin_s_;
  moment.converged = brief.features[perimap_FEATURE_CONVERGED];
  moment.others = brief.features[perimap_FEATURE_CONVERGING] + brief.features[perimap_FEATURE_INCONSISTENT];
  moment.deviation_mm = brief.median_deviation_mm;
  moment.capture_to_receipt_ms = 1e3 * to_seconds(receipt - from_ns(surface.capture_time_ns));
  surfaces_.push_back(moment);
}

void PublishedSession::add(const perimap_Phase& phase, Instant receipt) {
  const double at_s = seconds_of(receipt);
  phase_.say(at_s, words(name_of(phase.state)), tone_of(phase.state));
  // Of two beats between samples the interval is not known.
  if (phase.beats == last_beats_) return;
  if (phase.beats == last_beats_ + 1 && last_r_peak_ns_ != 0 && phase.last_r_peak_time_ns > last_r_peak_ns_) {
    rhythm_.push_back({at_s, 1e-9 * static_cast<double>(phase.last_r_peak_time_ns - last_r_peak_ns_)});
  }
  last_beats_ = phase.beats;
  last_r_peak_ns_ = phase.last_r_peak_time_ns;
}

void PublishedSession::add(const perimap_Status& status, Instant receipt) {
  const double at_s = seconds_of(receipt);
  set_up_.say(at_s, words(name_of(status.setup.state)), tone_of(status.setup.state));
  recording_.say(at_s, words(name_of(status.recording)), tone_of(status.recording));
  if (status.ecg_first_lead != perimap_ECG_LEAD_NONE) {
    lead_.say(at_s, words(name_of(status.ecg_first_lead)), tone_of(status.ecg_first_lead));
  }
  if (status.ecg_second_lead != perimap_ECG_LEAD_NONE) {
    second_lead_.say(at_s, words(name_of(status.ecg_second_lead)), tone_of(status.ecg_second_lead));
  }
  for (std::uint32_t i = 0; i < status.sources._length; ++i) {
    const perimap_SourceStatus& source = status.sources._buffer[i];
    const auto strip = sources_.try_emplace(source.kind, words(name_of(source.kind)), 2.5).first;
    strip->second.say(at_s, words(name_of(source.state)), tone_of(source.state));
  }
}

SessionRecord PublishedSession::record() const {
  SessionRecord record;
  record.begin_utc_ns = begin_utc_ns_;
  record.length_s = surfaces_.empty() ? 0.0 : surfaces_.back().at_s;
  record.first_good_s = first_good_s_;
  record.surfaces = surfaces_;
  for (RhythmMoment moment : rhythm_) {
    moment.at_s -= begin_s_;
    if (moment.at_s >= 0.0) record.rhythm.push_back(moment);
  }
  record.strips.push_back(moved(surface_, begin_s_));
  record.strips.push_back(moved(phase_, begin_s_));
  for (const auto& [kind, strip] : sources_) record.strips.push_back(moved(strip, begin_s_));
  for (const SessionStrip* strip : {&lead_, &second_lead_, &set_up_, &recording_}) {
    record.strips.push_back(moved(*strip, begin_s_));
  }
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

// The sentences of a session's page.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <perimap_client.hpp>
#include <tuple>

#include "daemon/evaluation/session/session_page.hpp"
#include "daemon/publishing/advice.hpp"
#include "daemon/publishing/wire_names.hpp"
#include "drivers/calibration/verification_record.hpp"

namespace perimap {
namespace {

// Deviations are right where this is 1: a mesh whose features differ from each other by twice what they say is told.
constexpr double kMostNees = 2.0;
// Less is the time between two surfaces.
constexpr double kLeastSilence_s = 0.05;

double seconds_of(const SessionRecord& record, Tone tone) {
  double seconds = 0.0;
  for (const StateShare& share : record.shares) seconds += share.tone == tone ? share.seconds : 0.0;
  return seconds;
}

double percent(double part, double whole) { return whole > 0.0 ? 100.0 * part / whole : 0.0; }

// "WHAT: 3", or "WHAT: 3 of 40" where it is known of how many.
void add(std::vector<std::string>& concerns, std::string_view what, std::uint64_t count, std::uint64_t of = 0) {
  if (count == 0) return;
  concerns.push_back(fmt::format("{}: {}{}", what, count, of >= count ? fmt::format(" of {}", of) : ""));
}

void add_counts(const StreamReport& counts, std::vector<std::string>& concerns) {
  add(concerns,
      "Surfaces that came while there were two publishers, or contradicted those before, and are counted as any other",
      counts.contested);
  add(concerns, "Surfaces published and not received", counts.missing);
  add(concerns, "Times that the publisher began anew", counts.restarts);
  add(concerns, "Surfaces received after the instant until which they hold", counts.expired);
}

void add_status(const StatusCounters& counters, std::vector<std::string>& concerns) {
  const auto count = [&counters](StatusCounters::Count of) { return counters.counts[of]; };
  const auto camera = counters.sources.find(perimap_SOURCE_CAMERA);
  const std::uint64_t frames = camera != counters.sources.end() ? camera->second.received : 0;
  const std::uint64_t published = count(StatusCounters::kPublished);
  add(concerns, "Frames without a pose of the scope", count(StatusCounters::kWithoutPose), frames);
  add(concerns, "Frames without a phase of the heart, as all are before its first beats are known",
      count(StatusCounters::kWithoutPhase), frames);
  add(concerns, "Surfaces that rest on the state before, because their update was late",
      count(StatusCounters::kLateUpdates), published);
  add(concerns, "Releases that were left out", count(StatusCounters::kReleasesMissed));
  add(concerns, "Releases that began more than half a millisecond after their deadline",
      count(StatusCounters::kReleasesLate), published);
  add(concerns, "Frames and other messages that were not recorded", count(StatusCounters::kNotRecorded));
  if (counters.recording_stopped) concerns.emplace_back("The recording stopped: the log says why");
  if (counters.priority_refused) concerns.emplace_back("Real-time priority was refused");
  if (counters.memory_refused) concerns.emplace_back("Locking of memory was refused");
  if (counters.latency_short)
    concerns.emplace_back("The latency is shorter than frames and their poses take to arrive");
  if (counters.respiration_suspected) {
    concerns.emplace_back("The surface moved as by breathing, which is not a part of the model (respiration.enabled)");
  }
  for (const auto& [kind, source] : counters.sources) {
    add(concerns, fmt::format("Samples of the {} that were lost on the way", name_of(kind)), source.lost,
        source.lost + source.received);
  }
}

// The instant at which the set-up was doubted first.
std::optional<double> doubted_from_s(const SessionRecord& record) {
  for (const SessionStrip& strip : record.strips) {
    for (const SessionSpan& span : strip.spans()) {
      if (span.what == name_of(perimap_SETUP_DOUBTED)) return span.begin_s;
    }
  }
  return std::nullopt;
}

// Of the time from an instant on: how long surfaces were good, and what they were the longest else.
struct Since {
  double good_s = 0.0;
  double length_s = 0.0;
  std::string obstacle;  // as StateShare::what; empty: there was none
  double obstacle_s = 0.0;
};
Since since(const SessionRecord& record, double from_s) {
  Since out;
  out.length_s = std::max(record.length_s - from_s, 0.0);
  std::map<std::string, double> others;
  double silent_s = out.length_s;
  for (const SessionSpan& span : record.strips.front().spans()) {
    const double seconds = std::max(span.end_s - std::max(span.begin_s, from_s), 0.0);
    (span.tone == Tone::kWell ? out.good_s : others[span.what]) += seconds;
    silent_s -= seconds;
  }
  if (silent_s > kLeastSilence_s) others["no surface came"] = silent_s;
  for (const auto& [what, seconds] : others) {
    if (seconds > out.obstacle_s) std::tie(out.obstacle, out.obstacle_s) = std::tie(what, seconds);
  }
  return out;
}

std::string obstacle_words(const SessionRecord& record, const Since& since) {
  if (since.obstacle.empty()) return {};
  std::string words = fmt::format(" What stood in the way most: {}, {:.1f} s", since.obstacle, since.obstacle_s);
  const auto share = std::find_if(record.shares.begin(), record.shares.end(),
                                  [&](const StateShare& known) { return known.what == since.obstacle; });
  if (share != record.shares.end() && share->reason != perimap_SURFACE_REASON_NONE) {
    words += fmt::format(" ({}; what helps: {})", client::describe(share->reason), remedy_of(share->reason));
  }
  return words + ".";
}

}  // namespace

std::string session_verdict(const SessionRecord& record) {
  const double length = record.length_s;
  if (!(length > 0.0)) return "There is one surface alone: of a session nothing can be told.";
  const double good = seconds_of(record, Tone::kWell);
  const double degraded = seconds_of(record, Tone::kDoubtful);
  const double invalid = seconds_of(record, Tone::kBad);
  const double silent = std::max(length - good - degraded - invalid, 0.0);
  std::string out = fmt::format(
      "Surfaces were good for {:.1f} % of {:.1f} s, to be used with care for {:.1f} %, and of no use for {:.1f} %",
      percent(good, length), length, percent(degraded, length), percent(invalid, length));
  if (silent > kLeastSilence_s) out += fmt::format("; for {:.1f} % none came", percent(silent, length));
  out += record.first_good_s ? fmt::format(". The first good one came after {:.1f} s.", *record.first_good_s)
                             : std::string(". Not one was good.");
  return out;
}

std::string session_answer(const SessionRecord& record) {
  if (!(record.length_s > 0.0) || record.strips.empty()) return session_verdict(record);
  const Since from = since(record, record.first_good_s.value_or(0.0));
  if (const auto doubted_s = doubted_from_s(record)) {
    return fmt::format("Do not rely on positions of this session: from {:.1f} s on its set-up was {}.", *doubted_s,
                       record.counters.doubt.empty() ? "doubted" : record.counters.doubt);
  }
  if (!record.first_good_s) return "Not one surface of this session was good." + obstacle_words(record, from);
  return fmt::format("From the first good surface on, after {:.1f} s, surfaces were good for {:.1f} % of {:.1f} s.{}",
                     *record.first_good_s, percent(from.good_s, from.length_s), from.length_s,
                     obstacle_words(record, from));
}

std::optional<ToldVerification> verification_of(const RecordedFile& file) {
  if (file.verification.empty()) return std::nullopt;
  const auto record = parse_verification(file.verification, file.path);
  if (!record) return ToldVerification{record.error().message, true};
  return ToldVerification{words_of(*record), record->is_doubtful()};
}

std::vector<std::string> session_concerns(const SessionRecord& record) {
  std::vector<std::string> concerns;
  for (const RecordedFile& file : record.files) {
    for (const std::string& damage : file.damage) concerns.push_back("A file is damaged: " + damage);
    const auto verified = verification_of(file);
    if (verified && verified->doubtful) concerns.push_back("The set-up was verified before: " + verified->words);
  }
  for (const SessionStrip& strip : record.strips) {
    const auto doubted = std::count_if(strip.spans().begin(), strip.spans().end(), [](const SessionSpan& span) {
      return span.what == name_of(perimap_SETUP_DOUBTED);
    });
    add(concerns, "Times that the set-up was doubted", static_cast<std::uint64_t>(doubted));
  }
  add_counts(record.counts, concerns);
  if (record.counts.status) {
    add_status(record.counters, concerns);
  } else {
    concerns.emplace_back("No status was recorded: nothing is known of devices, delays within perimapd, and set-up");
  }
  const auto contradicting = std::count_if(record.mesh.begin(), record.mesh.end(), [](const MeshMoment& moment) {
    return !(moment.leave_one_out_nees <= kMostNees);
  });
  add(concerns, "Meshes of which features differed from each other by more than their deviations say",
      static_cast<std::uint64_t>(contradicting), record.mesh.size());
  for (const std::string& other : record.other_streams) {
    concerns.push_back("The files have another stream, of which nothing is told here: " + other);
  }
  return concerns;
}

}  // namespace perimap

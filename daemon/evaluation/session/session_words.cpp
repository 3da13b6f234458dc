// The sentences of a session's page.
#include <fmt/format.h>

#include <algorithm>

#include "daemon/evaluation/session/session_page.hpp"
#include "daemon/publishing/wire_names.hpp"
#include "drivers/calibration/verification_record.hpp"

namespace perimap {
namespace {

// Deviations are right where this is 1: a mesh whose features differ from each other by twice what they say is told.
constexpr double kMostNees = 2.0;

double seconds_of(const SessionRecord& record, Tone tone) {
  double seconds = 0.0;
  for (const StateShare& share : record.shares) seconds += share.tone == tone ? share.seconds : 0.0;
  return seconds;
}

double percent(double part, double whole) { return whole > 0.0 ? 100.0 * part / whole : 0.0; }

void add_counts(const StreamReport& counts, std::vector<std::string>& concerns) {
  const auto add = [&concerns](std::uint64_t count, const char* what) {
    if (count > 0) concerns.push_back(fmt::format("{} {}", count, what));
  };
  add(counts.contested,
      "surfaces came while there were two publishers, or contradicted those before; they are counted here "
      "as any other");
  add(counts.missing, "surfaces were published and not received");
  add(counts.restarts, "times the publisher began anew");
  add(counts.expired, "surfaces were received after the instant until which they hold");
}

void add_status(const StatusCounters& counters, std::vector<std::string>& concerns) {
  const auto add = [&](StatusCounters::Count of, std::string_view what) {
    if (counters.counts[of] > 0) concerns.push_back(fmt::format("{} {}", counters.counts[of], what));
  };
  add(StatusCounters::kLateUpdates, "surfaces rest on the state before, because their update was late");
  add(StatusCounters::kReleasesMissed, "releases were left out");
  add(StatusCounters::kReleasesLate, "releases began more than half a millisecond after their deadline");
  add(StatusCounters::kWithoutPose, "frames had no pose");
  add(StatusCounters::kWithoutPhase, "frames had no phase");
  add(StatusCounters::kNotRecorded, "frames and other messages were not recorded");
  if (counters.recording_stopped) concerns.emplace_back("The recording stopped: the log says why");
  if (counters.priority_refused) concerns.emplace_back("Real-time priority was refused");
  if (counters.memory_refused) concerns.emplace_back("Locking of memory was refused");
  if (counters.latency_short)
    concerns.emplace_back("The latency is shorter than frames and their poses take to arrive");
  if (counters.respiration_suspected) {
    concerns.emplace_back("The surface moved as by breathing, which is not a part of the model (respiration.enabled)");
  }
  for (const auto& [kind, source] : counters.sources) {
    if (source.lost == 0) continue;
    concerns.push_back(fmt::format("{}: {} of {} samples were lost on the way", name_of(kind), source.lost,
                                   source.lost + source.received));
  }
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
  if (silent > 0.05) out += fmt::format("; for {:.1f} % none came", percent(silent, length));
  out += record.first_good_s ? fmt::format(". The first good one came after {:.1f} s.", *record.first_good_s)
                             : std::string(". Not one was good.");
  return out;
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
  add_counts(record.counts, concerns);
  if (record.counts.status) {
    add_status(record.counters, concerns);
  } else {
    concerns.emplace_back("No status was recorded: nothing is known of devices, delays within perimapd, and set-up");
  }
  for (const SessionStrip& strip : record.strips) {
    const auto doubted = std::count_if(strip.spans().begin(), strip.spans().end(),
                                       [](const SessionSpan& span) { return span.what == "doubted"; });
    if (doubted > 0) concerns.push_back(fmt::format("The set-up was doubted ({} times)", doubted));
  }
  const auto contradicting = std::count_if(record.mesh.begin(), record.mesh.end(), [](const MeshMoment& moment) {
    return !(moment.leave_one_out_nees <= kMostNees);
  });
  if (contradicting > 0) {
    concerns.push_back(
        fmt::format("In {} of {} meshes features differed from each other by more than their deviations say",
                    contradicting, record.mesh.size()));
  }
  for (const std::string& other : record.other_streams) {
    concerns.push_back("The files have another stream, of which nothing is told here: " + other);
  }
  return concerns;
}

}  // namespace perimap

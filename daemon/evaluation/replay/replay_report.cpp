#include "daemon/evaluation/replay/replay_report.hpp"

#include <fmt/format.h>

#include <chrono>

#include "core/pipeline/pipeline.hpp"
#include "daemon/evaluation/procedure/procedure_text.hpp"
#include "daemon/evaluation/report/accuracy_text.hpp"
#include "daemon/publishing/setup_text.hpp"
#include "daemon/publishing/wire_names.hpp"
#include "daemon/publishing/wire_states.hpp"
#include "daemon/publishing/wire_status.hpp"

namespace perimap {
namespace {

double microseconds(Duration d) { return std::chrono::duration<double, std::micro>(d).count(); }

nlohmann::json to_json(const LatencyHistogram::Summary& s) {
  return {{"count", s.count},
          {"p50_us", microseconds(s.p50)},
          {"p99_us", microseconds(s.p99)},
          {"max_us", microseconds(s.max)}};
}

std::string stage_table(const ReplayReport& report) {
  std::string table = fmt::format("{:<18} {:>8} {:>10} {:>10} {:>10}  (us)\n", "stage", "count", "p50", "p99", "max");
  for (const auto& [name, s] : report.stages) {
    table += fmt::format("{:<18} {:>8} {:>10.1f} {:>10.1f} {:>10.1f}\n", name, s.count, microseconds(s.p50),
                         microseconds(s.p99), microseconds(s.max));
  }
  return table;
}

// A line, or nothing where there is nothing to say.
std::string breath_text(const RespiratoryClock& clock) {
  switch (clock.state) {
    case RespirationState::kSearching:
      return "breathing   not found: positions leave it out\n";
    case RespirationState::kLocked:
      return fmt::format("breathing   {:.2f} s a breath, by the {}\n", to_seconds(clock.period()),
                         clock.source == RespirationSource::kChannel ? "respiration channel" : "images");
    case RespirationState::kOff:
      break;
  }
  return clock.suspected ? "breathing   suspected, and positions leave it out: set respiration.enabled = true\n" : "";
}

std::string setup_text(const perimap_SetupWatch& setup) {
  const std::string words = setup_words(setup);
  if (setup.first_doubted_ns == 0) return fmt::format("set-up      {}\n", words);
  return fmt::format("set-up      {} (doubted first {:.1f} s after the first frame)\n", words,
                     to_seconds(Duration(setup.first_doubted_ns)));
}

}  // namespace

std::string to_text(const ReplayReport& report) {
  std::string text = fmt::format("{}{} frames, {} of them without pose\n", report.stopped ? "stopped early: " : "",
                                 report.frames, report.frames_without_pose);
  for (const ReplayReport::Stream& s : report.streams) {
    text +=
        fmt::format("stream {}: {} samples ({} without frame, {} from a late update), {} releases missed, {} late\n",
                    name_of(s.stream), s.samples, s.without_frame, s.from_late_update, s.missed, s.late);
  }
  text += fmt::format("\n{}\n{}", stage_table(report), breath_text(report.breathing));
  text += setup_text(report.setup);
  for (const ReplayReport::Stream& s : report.streams) {
    if (!s.accuracy) continue;
    if (report.streams.size() > 1) text += fmt::format("stream {}\n", name_of(s.stream));
    text += to_text(*s.accuracy) + "\n";
    if (s.procedure) text += to_text(*s.procedure);
  }
  if (report.surface) text += to_text(*report.surface) + "\n";
  for (const auto& [tool, figures] : report.tools) text += to_text(tool, figures) + "\n";
  if (!report.has_truth) {
    text += fmt::format("no ground truth in this recording: {} features converged\n", report.features_converged);
  }
  return text;
}

nlohmann::json to_json(const ReplayReport& report) {
  nlohmann::json json = {{"lockstep", report.lockstep}, {"workers", report.workers}, {"counts", report.counts}};
  for (const ReplayReport::Stream& s : report.streams) {
    nlohmann::json& told = json["streams"][std::string(name_of(s.stream))] = s.counts;
    if (!s.accuracy) continue;
    // The first stream's in its old place, for who knows of no other.
    nlohmann::json& place = &s == &report.streams.front() ? json : told;
    place["accuracy"] = to_json(*s.accuracy);
    if (s.procedure) place["procedure"] = to_json(*s.procedure);
  }
  if (report.surface) json["surface"] = to_json(*report.surface);
  // The first one's, and where there are several all by their names.
  if (!report.tools.empty()) json["tool"] = to_json(report.tools.begin()->second);
  if (report.tools.size() > 1) {
    for (const auto& [tool, figures] : report.tools) json["tools"][tool] = to_json(figures);
  }
  json["setup"] = setup_json(report.setup);
  json["breath_s"] = to_seconds(report.breathing.period());
  json["breath_suspected"] = report.breathing.suspected;
  json["breath_state"] = name_of(to_wire(report.breathing.state));
  json["breath_source"] = name_of(to_wire(report.breathing.source));
  for (const auto& [name, times] : report.stages) json["stages"][name] = to_json(times);
  return json;
}

}  // namespace perimap

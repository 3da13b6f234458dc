#include "daemon/evaluation/watch/watch_report.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>

#include "core/angle/angle.hpp"
#include "daemon/evaluation/watch/watch_text.hpp"
#include "daemon/publishing/setup_text.hpp"
#include "daemon/publishing/status_text.hpp"
#include "daemon/publishing/tool_text.hpp"
#include "daemon/publishing/wire_names.hpp"
#include "drivers/json/json_text.hpp"

namespace perimap {
namespace {

using Json = nlohmann::ordered_json;

double ms(Duration duration) { return to_seconds(duration) * 1e3; }

Json spread_json(const DurationSpread& spread) {
  if (spread.count == 0) {
    return nullptr;
  }
  return {{"p50", ms(spread.p50)}, {"p99", ms(spread.p99)}, {"max", ms(spread.max)}};
}

std::string state_text(const SurfaceDigest& last) {
  return last.reason == perimap_SURFACE_REASON_NONE ? std::string(name_of(last.state))
                                                    : fmt::format("{} ({})", name_of(last.state), name_of(last.reason));
}

// What a release was late, and what a frame cost, over the last seconds; nothing when the publisher does not tell.
std::string stages_text(const StatusDigest& status) {
  std::string text;
  for (const perimap_StageLatency& stage : status.stages) {
    if (stage.recent_count == 0 || (stage.kind != perimap_STAGE_RELEASE_TARDINESS && stage.kind != perimap_STAGE_FRAME))
      continue;
    text += fmt::format(" | {} {:.2f} (p99 {:.2f}, p99.9 {:.2f}, max {:.2f}) ms",
                        stage.kind == perimap_STAGE_FRAME ? "frame" : "release", ms(Duration(stage.recent_p50_ns)),
                        ms(Duration(stage.recent_p99_ns)), ms(Duration(stage.recent_p999_ns)),
                        ms(Duration(stage.recent_max_ns)));
  }
  return text;
}

// Every stage, since the publisher's start and over its last seconds.
std::string stage_table(const StatusDigest& status) {
  std::string text = fmt::format("  {:<20}{:>10}{:>9}{:>9}{:>9}{:>9}   last {:>4.0f} s:{:>9}{:>9}{:>9}{:>9}  (ms)\n",
                                 "publisher's stages", "count", "p50", "p99", "p99.9", "max",
                                 to_seconds(Duration(status.status.recent_ns)), "p50", "p99", "p99.9", "max");
  for (const perimap_StageLatency& s : status.stages) {
    const auto in_ms = [](std::int64_t ns) { return ms(Duration(ns)); };
    text +=
        fmt::format("  {:<20}{:>10}{:>9.3f}{:>9.3f}{:>9.3f}{:>9.3f}{:>14}{:>9.3f}{:>9.3f}{:>9.3f}{:>9.3f}\n",
                    name_of(s.kind), s.count, in_ms(s.p50_ns), in_ms(s.p99_ns), in_ms(s.p999_ns), in_ms(s.max_ns), "",
                    in_ms(s.recent_p50_ns), in_ms(s.recent_p99_ns), in_ms(s.recent_p999_ns), in_ms(s.recent_max_ns));
  }
  return text;
}

std::string_view publishers_of(client::Hearing hearing) {
  switch (hearing) {
    case client::Hearing::kUse:
      return "one";
    case client::Hearing::kListening:
      return "listening";
    case client::Hearing::kAnotherBegan:
      return "another began";
    case client::Hearing::kTwoPublishers:
      return "two";
    case client::Hearing::kImplausible:
      return "at odds";
  }
  return "not known";
}

}  // namespace

std::string report_line(const StreamReport& report) {
  std::string line = fmt::format("{}/{}  ", report.source, report.stream);
  if (report.length > Duration(0)) {
    line += fmt::format("{:.1f}/s, {} lost", rate_hz(report, ReportKind::kInterval), report.missing);
  } else if (report.last) {
    line += fmt::format("surface {}", report.last->sample_sequence);
  }
  if (report.restarts > 0) {
    line += fmt::format(", {} restarts", report.restarts);
  }
  if (report.received > 0) {
    line += fmt::format(" | latency {} ms | late {} ms | jitter {} ms", spread_text(report.latency),
                        spread_text(report.lateness), spread_text(report.jitter));
  }
  if (at_odds(report.hearing)) line += fmt::format(" | {}", client::describe(report.hearing));
  if (report.received > 0 && report.last && !at_odds(report.hearing)) {
    const SurfaceDigest& last = *report.last;
    line += fmt::format(" | phase {:.0f} +- {:.1f} deg, {:.1f}/min | {} | {}", last.cardiac_phase_rad / kDegree,
                        last.cardiac_phase_deviation_rad / kDegree,
                        last.cardiac_phase_rate_rad_per_s * kPerMinutePerRadian, features_text(last), state_text(last));
  }
  if (!at_odds(report.hearing)) {
    for (const ToolReport& tool : report.tools) line += " | " + tool_words(tool.last);
  }
  if (report.status) line += stages_text(*report.status);
  if (report.status && report.status->status.setup.state == perimap_SETUP_DOUBTED) {
    line += " | set-up " + setup_words(report.status->status.setup);
  }
  if (report.status && report.status->status.recording == perimap_RECORDING_STOPPED) line += " | RECORDING STOPPED";
  return line;
}

std::string summary_text(const StreamReport& report) {
  std::string text =
      fmt::format("{}/{}: {} surfaces in {:.1f} s ({:.2f}/s), {} lost, {} received after their validity, {} restarts\n",
                  report.source, report.stream, report.received, to_seconds(report.length),
                  rate_hz(report, ReportKind::kSummary), report.missing, report.expired, report.restarts);
  text += fmt::format("  latency, receipt minus capture   {} ms\n", spread_text(report.latency));
  text += fmt::format("  late, receipt minus release      {} ms\n", spread_text(report.lateness));
  text += fmt::format("  jitter as received               {} ms\n", spread_text(report.jitter));
  if (report.contested > 0) {
    text += fmt::format("  NOT TO BE USED: {} surfaces of two publishers, or at odds with those before\n",
                        report.contested);
  }
  if (report.last) {
    text += fmt::format("  last surface: {}; {}\n", state_text(*report.last), features_text(*report.last));
    if (report.last->uses) text += fmt::format("  it may be used to: {}\n", uses_words(*report.last->uses));
  }
  for (const ToolReport& tool : report.tools) {
    text += fmt::format("  tool {}; {} received, {} lost\n", tool_words(tool.last), tool.received, tool.missing);
  }
  if (report.status) text += fmt::format("  set-up: {}\n", setup_words(report.status->status.setup));
  if (report.status && !report.status->stages.empty()) text += stage_table(*report.status);
  return text;
}

std::string report_json(const StreamReport& report, ReportKind kind) {
  Json json = {{"kind", kind == ReportKind::kInterval ? "interval" : "summary"},
               {"source", report.source},
               {"stream", report.stream},
               {"seconds", to_seconds(report.length)},
               {"received", report.received},
               {"missing", report.missing},
               {"restarts", report.restarts},
               {"expired", report.expired},
               {"contested", report.contested},
               {"publishers", publishers_of(report.hearing)},
               {"rate_hz", rate_hz(report, kind)},
               {"latency_ms", spread_json(report.latency)},
               {"lateness_ms", spread_json(report.lateness)},
               {"jitter_ms", spread_json(report.jitter)}};
  if (report.last) {
    const SurfaceDigest& last = *report.last;
    json["sample_sequence"] = last.sample_sequence;
    json["state"] = name_of(last.state);
    json["reason"] = name_of(last.reason);
    json["cardiac_phase_rad"] = last.cardiac_phase_rad;
    json["cardiac_phase_deviation_rad"] = last.cardiac_phase_deviation_rad;
    json["cardiac_rate_per_min"] = last.cardiac_phase_rate_rad_per_s * kPerMinutePerRadian;
    Json features = Json::object();
    for (std::size_t state = 0; state < last.features.size(); ++state) {
      features[std::string(name_of(static_cast<perimap_FeatureState>(state)))] = last.features[state];
    }
    json["features"] = std::move(features);
    if (last.uses) json["uses"] = uses_json(*last.uses);
    json["median_deviation_mm"] = last.median_deviation_mm ? Json(*last.median_deviation_mm) : Json(nullptr);
  }
  if (!report.tools.empty()) {
    Json tools = Json::array();
    for (const ToolReport& tool : report.tools) {
      Json one = tool_json(tool.last);
      one["received"] = tool.received;
      one["missing"] = tool.missing;
      tools.push_back(std::move(one));
    }
    json["tools"] = std::move(tools);
  }
  if (report.status) {
    json["status"] = status_json(report.status->status, report.status->stages, report.status->sources);
  }
  return json_line(json);
}

std::string surface_json(const perimap_Surface& surface, Instant receipt) {
  Json json = {{"kind", "surface"},
               {"source", surface.source},
               {"stream", surface.stream},
               {"frame_id", surface.frame_id},
               {"receipt_time_ns", to_ns(receipt)},
               {"sample_sequence", surface.sample_sequence},
               {"frame_sequence", surface.frame_sequence},
               {"capture_time_ns", surface.capture_time_ns},
               {"release_time_ns", surface.release_time_ns},
               {"valid_time_ns", surface.valid_time_ns},
               {"valid_until_ns", surface.valid_until_ns},
               {"release_utc_ns", surface.release_utc_ns},
               {"state", name_of(surface.state)},
               {"reason", name_of(surface.reason)},
               {"oldest_shard_frame_sequence", surface.oldest_shard_frame_sequence},
               {"cardiac_phase_rad", surface.cardiac_phase_rad},
               {"cardiac_phase_deviation_rad", surface.cardiac_phase_deviation_rad},
               {"cardiac_phase_rate_rad_per_s", surface.cardiac_phase_rate_rad_per_s}};
  if (const auto uses = uses_of(surface)) json["uses"] = uses_json(*uses);
  if (surface.camera_pose_known) {
    json["translation_WC_mm"] = surface.translation_WC_mm;
    json["rotation_WC_wxyz"] = surface.rotation_WC_wxyz;
    json["camera_focal_px"] = surface.camera_focal_px;
    json["camera_principal_point_px"] = surface.camera_principal_point_px;
  }
  Json features = Json::array();
  for (std::uint32_t i = 0; i < surface.features._length; ++i) {
    const perimap_SurfaceFeature& feature = surface.features._buffer[i];
    features.push_back({{"id", feature.id},
                        {"state", name_of(feature.state)},
                        {"reason", name_of(feature.reason)},
                        {"position_W_mm", feature.position_W_mm},
                        {"velocity_W_mm_per_s", feature.velocity_W_mm_per_s},
                        {"covariance_W_mm2", feature.covariance_W_mm2},
                        {"last_observed_time_ns", feature.last_observed_time_ns}});
  }
  json["features"] = std::move(features);
  return json_line(json);
}

}  // namespace perimap

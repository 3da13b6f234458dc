#include "daemon/publishing/status_text.hpp"

#include <fmt/format.h>

#include <chrono>
#include <string>
#include <utility>

#include "core/angle/angle.hpp"
#include "daemon/publishing/setup_text.hpp"
#include "daemon/publishing/wire_names.hpp"

namespace perimap {
namespace {

using Json = nlohmann::ordered_json;

double ms(std::int64_t ns) { return static_cast<double>(ns) * 1e-6; }

Json sources_json(const perimap_Status& status, std::span<const perimap_SourceStatus> sources) {
  Json json = Json::object();
  for (const perimap_SourceStatus& source : sources) {
    const bool any_good = source.last_good_time_ns != 0;
    json[std::string(name_of(source.kind))] = {
        {"state", name_of(source.state)},
        {"received", source.received},
        {"rate_hz", source.rate_hz},
        {"dropped", source.dropped},
        {"invalid", source.invalid},
        {"age_ms", ms(status.time_ns - source.last_source_time_ns)},
        {"last_good_age_ms", any_good ? Json(ms(status.time_ns - source.last_good_time_ns)) : Json(nullptr)},
        {"delay_p50_ms", ms(source.delay_p50_ns)},
        {"delay_p99_ms", ms(source.delay_p99_ns)},
        {"delay_max_ms", ms(source.delay_max_ns)},
        {"jitter_p50_ms", ms(source.jitter_p50_ns)},
        {"jitter_p99_ms", ms(source.jitter_p99_ns)}};
  }
  return json;
}

Json stage_json(const perimap_StageLatency& stage) {
  return {{"count", stage.count},
          {"p50", ms(stage.p50_ns)},
          {"p99", ms(stage.p99_ns)},
          {"p999", ms(stage.p999_ns)},
          {"max", ms(stage.max_ns)},
          {"recent",
           {{"count", stage.recent_count},
            {"p50", ms(stage.recent_p50_ns)},
            {"p99", ms(stage.recent_p99_ns)},
            {"p999", ms(stage.recent_p999_ns)},
            {"max", ms(stage.recent_max_ns)}}}};
}

// Which of two leads of the ECG.
std::string leads_off(const perimap_Status& status) {
  if (status.ecg_second_lead == perimap_ECG_LEAD_NONE) return {};
  const auto off = [](perimap_EcgLead lead) {
    return lead == perimap_ECG_LEAD_FLAT || lead == perimap_ECG_LEAD_OFF || lead == perimap_ECG_LEAD_REPEATED;
  };
  std::string text;
  if (off(status.ecg_first_lead)) text += fmt::format(", first lead of the ECG {}", name_of(status.ecg_first_lead));
  if (off(status.ecg_second_lead)) text += fmt::format(", second lead of the ECG {}", name_of(status.ecg_second_lead));
  return text;
}

std::string_view displaced_words(perimap_DisplacedCause cause) {
  switch (cause) {
    case perimap_DISPLACED_CAUSE_ORGAN:
      return "the organ was moved";
    case perimap_DISPLACED_CAUSE_TRACKER:
      return "the tracker errs";
    case perimap_DISPLACED_CAUSE_UNKNOWN:
      break;
  }
  return "the organ or the tracker";
}

}  // namespace

Json stream_counts_json(const perimap_Status& status) {
  return {{"samples", status.samples},
          {"samples_without_frame", status.samples_without_frame},
          {"samples_from_late_update", status.samples_from_late_update},
          {"releases_missed", status.releases_missed},
          {"releases_late", status.releases_late}};
}

Json counts_json(const perimap_Status& status) {
  Json json = {{"frames", status.frames},
               {"frames_too_late", status.frames_too_late},
               {"frames_without_pose", status.frames_without_pose},
               {"frames_without_phase", status.frames_without_phase},
               {"poses_repeated", status.poses_repeated},
               {"frames_repeated", status.frames_repeated},
               {"ecg_samples_repeated", status.ecg_samples_repeated},
               {"times_displaced", status.times_displaced},
               {"maps_moved", status.maps_moved},
               {"phases_from_image", status.phases_from_image}};
  json.update(stream_counts_json(status));
  json.update({{"learning_put_off", status.learning_put_off},
               {"adoptions_late", status.adoptions_late},
               {"features_tracked", status.features_tracked},
               {"features_starting", status.features_starting},
               {"features_converging", status.features_converging},
               {"features_converged", status.features_converged},
               {"features_inconsistent", status.features_inconsistent},
               {"features_shed", status.features_shed},
               {"times_shed", status.times_shed},
               {"features_lost", status.features_lost},
               {"features_lost_unseen", status.features_lost_unseen},
               {"features_lost_refused", status.features_lost_refused},
               {"features_lost_unstarted", status.features_lost_unstarted},
               {"starts_failed_unusable", status.starts_failed_unusable},
               {"starts_failed_behind", status.starts_failed_behind},
               {"starts_failed_diverged", status.starts_failed_diverged},
               {"starts_failed_outliers", status.starts_failed_outliers},
               {"start_matches_needed", status.start_matches_needed},
               {"start_matches_most", status.start_matches_most},
               {"start_matches_mean", status.start_matches_mean},
               {"features_started_anew", status.features_started_anew},
               {"scope_turns", status.scope_turns},
               {"scope_frames_unread", status.scope_frames_unread}});
  return json;
}

Json status_json(const perimap_Status& status, std::span<const perimap_StageLatency> stages,
                 std::span<const perimap_SourceStatus> sources) {
  Json json = {
      {"version", status.version},
      {"realtime_priority", name_of(status.realtime_priority)},
      {"memory_locked", name_of(status.memory_locked)},
      {"latency_ms", ms(status.latency_ns)},
      {"latency_short", status.latency_short},
      {"two_publishers", status.two_publishers},
      {"keys_expire_utc_ns", status.keys_expire_utc_ns == 0 ? Json(nullptr) : Json(status.keys_expire_utc_ns)},
      {"phase", name_of(status.phase_state)},
      {"rhythm", name_of(status.rhythm)},
      {"respiration", name_of(status.respiration)},
      {"respiration_suspected", status.respiration_suspected},
      {"respiration_source", name_of(status.respiration_source)},
      {"setup", setup_json(status.setup)},
      {"displaced_mm", status.displaced_mm},
      {"displaced_cause", name_of(status.displaced_cause)},
      {"scope_turn", name_of(status.scope_turn)},
      {"scope_rotation_deg",
       status.scope_turn == perimap_SCOPE_TURN_UNREAD ? Json(nullptr) : Json(status.scope_rotation_rad / kDegree)},
      {"ecg_leads", {name_of(status.ecg_first_lead), name_of(status.ecg_second_lead)}},
      {"recording", name_of(status.recording)},
      {"messages_recorded", status.messages_recorded},
      {"frames_not_recorded", status.frames_not_recorded},
      {"other_not_recorded", status.other_not_recorded}};
  json.update(counts_json(status));
  Json by_stage = Json::object();
  for (const perimap_StageLatency& stage : stages) by_stage[std::string(name_of(stage.kind))] = stage_json(stage);
  json["recent_s"] = ms(status.recent_ns) * 1e-3;
  json["stages_ms"] = std::move(by_stage);
  json["sources"] = sources_json(status, sources);
  return json;
}

Json full_status_json(const perimap_Status& status) {
  return status_json(status, {status.stages._buffer, status.stages._length},
                     {status.sources._buffer, status.sources._length});
}

Json stream_status_json(const perimap_Status& status) {
  Json json = stream_counts_json(status);
  for (const perimap_StageLatency& stage : std::span(status.stages._buffer, status.stages._length)) {
    if (stage.kind != perimap_STAGE_RELEASE_TARDINESS && stage.kind != perimap_STAGE_DDS_WRITE) continue;
    json["stages_ms"][std::string(name_of(stage.kind))] = stage_json(stage);
  }
  return json;
}

std::string status_line(const perimap_Status& status) {
  std::string line =
      fmt::format("{} surfaces published, {} features converged", status.samples, status.features_converged);
  if (status.features_converged == 0 && status.features_tracked > 0) {
    line += fmt::format(", {} followed with {} of the {} matches of a start", status.features_tracked,
                        status.start_matches_mean, status.start_matches_needed);
  }
  for (const auto& [count, what] : {std::pair(status.poses_repeated, "poses"),
                                    {status.frames_repeated, "pictures"},
                                    {status.ecg_samples_repeated, "ECG samples"}}) {
    if (count > 0) line += fmt::format(", {} {} were ones before bit for bit", count, what);
  }
  if (status.displaced_mm > 0.0) {
    line += fmt::format(", the surface is displaced by {:.1f} mm ({})", status.displaced_mm,
                        displaced_words(status.displaced_cause));
  }
  if (status.setup.state == perimap_SETUP_DOUBTED) line += ", set-up " + setup_words(status.setup);
  if (status.keys_expire_utc_ns != 0) {
    // DDS takes who has no valid keys any more out of the domain without a word.
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    if (std::chrono::nanoseconds(status.keys_expire_utc_ns) <= now) line += ", KEYS HAVE ENDED: nothing is published";
  }
  if (status.two_publishers) line += ", TWO PUBLISHERS of this source";
  line += leads_off(status);
  for (const perimap_SourceStatus& source : std::span(status.sources._buffer, status.sources._length)) {
    if (source.state != perimap_SOURCE_OK) line += fmt::format(", {} {}", name_of(source.kind), name_of(source.state));
  }
  return line;
}

}  // namespace perimap

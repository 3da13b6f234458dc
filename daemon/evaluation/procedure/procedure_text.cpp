#include "daemon/evaluation/procedure/procedure_text.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "daemon/evaluation/json/json_number.hpp"
#include "daemon/publishing/wire_names.hpp"

namespace perimap {
namespace {

nlohmann::json or_null(const std::optional<double>& value) { return value ? nlohmann::json(*value) : nlohmann::json(); }

nlohmann::json to_json(const ScoredEvent& scored) {
  return {{"kind", scored.event.kind},
          {"words", scored.event.words},
          {"begin_s", scored.event.begin_s},
          {"end_s", scored.event.end_s},
          {"hides", scored.event.hides},
          {"told_after_s", or_null(scored.told_after_s)},
          {"cause", scored.cause ? nlohmann::json(std::string(name_of(*scored.cause))) : nlohmann::json()},
          {"right", scored.right ? nlohmann::json(*scored.right) : nlohmann::json()},
          {"good_again_after_s", or_null(scored.good_again_after_s)},
          {"wrong_while_good_s", scored.wrong_while_good_s}};
}

std::string in_s(const std::optional<double>& value) { return value ? fmt::format("{:.1f}", *value) : "-"; }

}  // namespace

std::string to_text(const ProcedureScore& score) {
  const ProcedureScore::Worst& worst = score.worst_ten_seconds;
  const std::string causes = score.causes_judged == 0
                                 ? "none to judge"
                                 : fmt::format("{} of {} right", score.causes_right, score.causes_judged);
  std::string text = fmt::format(
      "procedure   availability {:.1f} % of {:.0f} s in which nothing hid the organ\n"
      "            {} false alarms in {:.0f} s ({:.1f} an hour), wrong while good {:.2f} s ({:.2f} s of them before "
      "the "
      "ECG could tell)\n"
      "            causes {}; {} of {} events good again in time\n"
      "            worst ten seconds from {:.0f} s on: {:.2f} s wrong while good, largest error {:.1f} mm\n",
      100.0 * score.availability, score.seen_s, score.false_alarms.size(), score.duration_s,
      score.false_alarms_per_hour(), score.wrong_while_good_s, score.wrong_before_known_s, causes,
      score.events_recovered, score.events_to_recover, worst.begin_s, worst.wrong_s, worst.largest_mm);
  text += fmt::format("\n{:>8} {:>7} {:>10} {:<24} {:<6} {:>10} {:>7}  {}\n", "at s", "for s", "told after",
                      "cause said", "right", "good again", "wrong s", "event");
  for (const ScoredEvent& scored : score.events) {
    text +=
        fmt::format("{:>8.1f} {:>7.1f} {:>10} {:<24} {:<6} {:>10} {:>7.2f}  {}\n", scored.event.begin_s,
                    scored.event.end_s - scored.event.begin_s, in_s(scored.told_after_s),
                    scored.cause ? name_of(*scored.cause) : "-", scored.right ? (*scored.right ? "yes" : "no") : "-",
                    in_s(scored.good_again_after_s), scored.wrong_while_good_s, scored.event.words);
  }
  for (const FalseAlarm& alarm : score.false_alarms) {
    text += fmt::format("false alarm from {:.1f} to {:.1f} s: {}\n", alarm.begin_s, alarm.end_s, name_of(alarm.reason));
  }
  return text;
}

nlohmann::json to_json(const ProcedureScore& score) {
  nlohmann::json events = nlohmann::json::array(), alarms = nlohmann::json::array();
  for (const ScoredEvent& scored : score.events) events.push_back(to_json(scored));
  for (const FalseAlarm& alarm : score.false_alarms) {
    alarms.push_back(
        {{"begin_s", alarm.begin_s}, {"end_s", alarm.end_s}, {"reason", std::string(name_of(alarm.reason))}});
  }
  const ProcedureScore::Worst& worst = score.worst_ten_seconds;
  return {
      {"begin_s", score.begin_s},
      {"duration_s", score.duration_s},
      {"seen_s", score.seen_s},
      {"availability", score.availability},
      {"false_alarms", alarms},
      {"false_alarms_per_hour", score.false_alarms_per_hour()},
      {"wrong_while_good_s", score.wrong_while_good_s},
      {"wrong_before_known_s", score.wrong_before_known_s},
      {"cause_accuracy", json_number(score.cause_accuracy())},
      {"causes_right", score.causes_right},
      {"causes_judged", score.causes_judged},
      {"events_recovered", score.events_recovered},
      {"events_to_recover", score.events_to_recover},
      {"worst_ten_seconds", {{"begin_s", worst.begin_s}, {"wrong_s", worst.wrong_s}, {"largest_mm", worst.largest_mm}}},
      {"events", events}};
}

}  // namespace perimap

#include "daemon/standins/options/scope_options.hpp"

#include <algorithm>
#include <cstddef>

#include "core/angle/angle.hpp"

namespace perimap {

void ScopeOptions::add_to(Command& command) {
  command
      .add_option("--field-stop", notch_deg_,
                  "An angled scope whose field stop leaves a round of the picture: its notch is so many degrees from "
                  "the right towards below, and hand-eye and principal point are as the scope is turned then [none]")
      ->check(Range(-360.0, 360.0));
  command
      .add_option("--turn-to", turn_to_deg_,
                  "The scope is turned in its camera head meanwhile, until its notch is there; of a board also several "
                  "times, each within two seconds")
      ->one_at_a_time()
      ->check(Range(-360.0, 360.0));
  command.add_option("--zoom", zoom_, "With --field-stop: so many times larger are picture and field stop")
      ->check(Range(0.5, 2.0))
      ->capture_default_str();
  command.add_flag("--second-sensor", second_sensor_,
                   "With --field-stop: a second tracked sensor, on the scope, tells how that is turned; the field stop "
                   "lies outside the picture then");
  command.add_flag("--scope-uncalibrated", uncalibrated_,
                   "Of a heart with --field-stop: the recording has hand-eye and lens of its start alone, and not what "
                   "follows when the scope is turned");
  command
      .add_option("--zoom-to", zoom_to_,
                  "The scope is zoomed to that meanwhile; of a board also several times, each within two seconds")
      ->one_at_a_time()
      ->check(Range(0.5, 2.0));
  command.add_option("--zoom-at", zoom_at_s_, "Of a board: when each of --zoom-to begins, s")
      ->one_at_a_time()
      ->check(Range(0.0, 1700.0));
  command
      .add_option("--turn-at", turn_at_s_,
                  "When each of --turn-to begins, s; of a heart, which is turned and zoomed at once, it takes one [10]")
      ->one_at_a_time()
      ->check(Range(0.0, 1700.0));
}

Expected<void> ScopeOptions::check(std::optional<BenchAct> act) const {
  const std::size_t turns = turn_to_deg_.size(), zooms = zoom_to_.size();
  if (turns + zooms > 0 && !notch_deg_) {
    return fail("--turn-to, --zoom-to: expected --field-stop, where the notch is before");
  }
  if (act && act != BenchAct::kBoard && turns + zooms > 0) {
    return fail("--turn-to, --zoom-to: expected --scene heart or board");
  }
  if (!act && (turns > 1 || zooms > 1)) {
    return fail("--turn-to, --zoom-to: before a heart the scope is turned and zoomed once");
  }
  const bool turned_as_often = act ? turn_at_s_.size() == turns : turn_at_s_.size() <= 1;
  if (!turned_as_often) return fail("--turn-at: expected one of each --turn-to, when it begins");
  if (zoom_at_s_.size() != (act ? zooms : 0)) {
    return fail("--zoom-at: expected --scene board, and one of each --zoom-to, when it begins");
  }
  if (zoom_ != 1.0 && !notch_deg_) return fail("--zoom: expected --field-stop, which tells of it");
  if (second_sensor_ && !notch_deg_) {
    return fail("--second-sensor: expected --field-stop, how the scope is turned");
  }
  if (second_sensor_ && zooms > 0) return fail("--second-sensor: expected no --zoom-to, of which it does not tell");
  return {};
}

void ScopeOptions::apply(SimulationSettings& settings) const {
  if (notch_deg_) settings.held = ScopeHeld{*notch_deg_ * kDegree, zoom_};
  settings.scope_calibrated = !uncalibrated_;
  settings.second_sensor = second_sensor_;
  if (turn_to_deg_.empty() && zoom_to_.empty()) return;
  constexpr double kUsualTurn_s = 10.0;
  const double to_deg = turn_to_deg_.empty() ? *notch_deg_ : turn_to_deg_.front();
  const ScopeHeld to{to_deg * kDegree, zoom_to_.empty() ? zoom_ : zoom_to_.front()};
  const double at_s = turn_at_s_.empty() ? kUsualTurn_s : turn_at_s_.front();
  settings.turn = SimulationSettings::Turn{from_seconds(at_s), to};
}

void ScopeOptions::apply(BenchSettings& settings) const {
  if (notch_deg_) settings.notch_rad = *notch_deg_ * kDegree;
  settings.zoom = zoom_;
  settings.second_sensor = second_sensor_;
  settings.turns = bench_turns();
}

std::vector<BenchSettings::Turn> ScopeOptions::bench_turns() const {
  struct Change {
    double at_s;
    std::optional<double> turn_to_deg;
    std::optional<double> zoom_to;
  };
  std::vector<Change> changes;
  for (std::size_t i = 0; i < turn_to_deg_.size(); ++i) {
    changes.push_back({turn_at_s_.at(i), turn_to_deg_[i], std::nullopt});
  }
  for (std::size_t i = 0; i < zoom_to_.size(); ++i) {
    changes.push_back({zoom_at_s_.at(i), std::nullopt, zoom_to_[i]});
  }
  std::stable_sort(changes.begin(), changes.end(), [](const Change& a, const Change& b) { return a.at_s < b.at_s; });
  std::vector<BenchSettings::Turn> turns;
  ScopeHeld held{notch_deg_.value_or(0.0) * kDegree, zoom_};
  for (const Change& change : changes) {
    if (change.turn_to_deg) held.notch_rad = *change.turn_to_deg * kDegree;
    held.zoom = change.zoom_to.value_or(held.zoom);
    turns.push_back({from_seconds(change.at_s), held});
  }
  return turns;
}

}  // namespace perimap

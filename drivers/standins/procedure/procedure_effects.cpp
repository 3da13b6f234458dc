#include "drivers/standins/procedure/procedure_effects.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "drivers/standins/random/counter_noise.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr std::uint64_t kArcStream = 0x617263;
constexpr double kRadians_per_degree = std::numbers::pi / 180.0;

double smooth(double s) noexcept {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * (3.0 - 2.0 * s);
}

bool is_under_way(const ProcedureEvent& event, Duration since) noexcept {
  return since >= event.at && since < event.end();
}

// Amplitude of the arcs, mV; 0: there are none.
double arcs_mV(const Procedure& procedure, Duration since) noexcept {
  double mV = 0.0;
  for (const ProcedureEvent& event : procedure.events) {
    if (!is_under_way(event, since)) continue;
    if (const auto* arc = std::get_if<Electrosurgery>(&event.what)) mV = std::max(mV, arc->ecg_mV);
  }
  return mV;
}

}  // namespace

double come(const ProcedureEvent& event, Duration since) noexcept {
  return smooth(to_seconds(since - event.at) / to_seconds(event.length));
}

double within(const ProcedureEvent& event, Duration since, Duration edge) noexcept {
  if (!is_under_way(event, since)) return 0.0;
  const Duration ramp = std::min(edge, event.length / 3);
  const Duration to_edge = std::min(since - event.at, event.end() - since);
  return smooth(to_seconds(to_edge) / to_seconds(ramp));
}

double drawn_back_mm(const Procedure& procedure, Duration since) noexcept {
  constexpr double kFar_mm = 160.0;
  double far_mm = 0.0;
  for (const ProcedureEvent& event : procedure.events) {
    if (std::holds_alternative<Withdrawn>(event.what)) far_mm += kFar_mm * within(event, since, milliseconds(1500));
  }
  return far_mm;
}

ScopeAsHeld turned_scope(const Procedure& procedure, const ScopeAsHeld& first, Duration since) noexcept {
  ScopeAsHeld state = first;
  for (const ProcedureEvent& event : procedure.events) {
    const auto* turn = std::get_if<ScopeTurnedInHead>(&event.what);
    if (turn == nullptr) continue;
    const double share = come(event, since);
    state.notch_deg += share * (turn->to_deg - state.notch_deg);
    state.zoom += share * (turn->zoom - state.zoom);
  }
  return state;
}

ScopeTurning scope_turning(const Procedure& procedure, Duration since) noexcept {
  ScopeTurning turning;
  for (const ProcedureEvent& event : procedure.events) {
    if (!std::holds_alternative<ScopeTurnedInHead>(event.what)) continue;
    if (since >= event.end()) ++turning.turns;
    turning.under_way = turning.under_way || is_under_way(event, since);
  }
  return turning;
}

PictureState picture_state(const Procedure& procedure, Duration since) {
  constexpr Duration kEdge = milliseconds(700);
  PictureState state;
  // Of what lies over another, the denser counts: shares must not come to more than 1.
  const auto raise = [](double& share, double to) { share = std::max(share, to); };
  // The trocar's mouth is passed when the scope has come 40 mm back.
  raise(state.trocar, smooth((drawn_back_mm(procedure, since) - 30.0) / 20.0));
  for (std::size_t i = 0; i < procedure.events.size(); ++i) {
    const ProcedureEvent& event = procedure.events[i];
    if (!is_under_way(event, since)) continue;
    const double here = within(event, since, kEdge);
    const std::uint64_t number = i + 1;
    if (std::holds_alternative<Wiped>(event.what)) {
      raise(state.cloth, here);
    } else if (const auto* fog = std::get_if<Fogged>(&event.what)) {
      state.fog += fog->density * within(event, since, milliseconds(2000));
    } else if (const auto* smoke = std::get_if<Smoke>(&event.what)) {
      state.smoke += smoke->density * within(event, since, milliseconds(1500));
    } else if (const auto* blood = std::get_if<Blood>(&event.what)) {
      state.blood.push_back({blood->share * here, number});
    } else if (const auto* arc = std::get_if<Electrosurgery>(&event.what)) {
      raise(state.bands_levels, here > 0.0 ? arc->picture_levels : 0.0);
      // It gathers.
      state.smoke += arc->smoke_density * here * come(event, since);
    } else if (std::holds_alternative<InstrumentSeen>(event.what)) {
      state.shafts.push_back({here, number});
    } else if (const auto* touch = std::get_if<Touch>(&event.what)) {
      // The tip is there before it presses.
      state.shafts.push_back({smooth(3.0 * here), number, true, touch->place_mm, touch->depth_mm});
    }
  }
  return state;
}

TrackerTrouble tracker_trouble(const Procedure& procedure, Duration since) noexcept {
  TrackerTrouble trouble;
  for (const ProcedureEvent& event : procedure.events) {
    if (!is_under_way(event, since)) continue;
    trouble.hidden = trouble.hidden || std::holds_alternative<ToolHidden>(event.what);
    if (const auto* metal = std::get_if<Metal>(&event.what)) {
      const double here = within(event, since, milliseconds(2000));
      trouble.shift_mm += here * metal->shift_mm;
      trouble.turn_rad += here * metal->turn_deg * kRadians_per_degree;
    } else if (const auto* arc = std::get_if<Electrosurgery>(&event.what)) {
      trouble.deviation_mm += arc->tracker_mm;
    }
  }
  return trouble;
}

bool leads_off(const Procedure& procedure, Duration since) noexcept {
  return std::any_of(procedure.events.begin(), procedure.events.end(), [since](const ProcedureEvent& event) {
    return std::holds_alternative<LeadsOff>(event.what) && is_under_way(event, since);
  });
}

double arc_mV(const Procedure& procedure, std::uint64_t seed, Duration since, std::int64_t sample) noexcept {
  const double most_mV = arcs_mV(procedure, since);
  if (!(most_mV > 0.0)) return 0.0;
  const CounterNoise noise(seed, kArcStream);
  constexpr double kApart_s = 0.15;
  const auto slot = static_cast<std::uint64_t>(to_seconds(since) / kApart_s);
  const double within_s = to_seconds(since) - static_cast<double>(slot) * kApart_s;
  const std::uint64_t at = 8 * slot;
  const double half_s = noise.uniform(at, 0.015, 0.04);
  const double middle_s = noise.uniform(at + 1, half_s, kApart_s - half_s);
  double height_mV = noise.uniform(at + 2) < 0.9 ? most_mV * noise.uniform(at + 3, 0.3, 1.0) : 0.0;
  if (noise.uniform(at + 4) < 0.5) height_mV = -height_mV;
  const double arc = height_mV * std::max(0.0, 1.0 - std::abs(within_s - middle_s) / half_s);
  constexpr std::uint64_t kSamples = std::uint64_t{1} << 40;  // the samples' numbers are none of the slots'
  return arc + noise.uniform(kSamples + static_cast<std::uint64_t>(sample), -0.2, 0.2) * most_mV;
}

}  // namespace perimap

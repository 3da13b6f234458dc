// What can be said of each kind of event in a file: names, units and limits, for all who read, check, draw or write
// one.
#pragma once

#include <array>
#include <string_view>
#include <tuple>
#include <utility>

#include "drivers/standins/procedure/procedure.hpp"

namespace perimap {

// One value of an event, or all components of one: numbers from `least` to `most`.
struct ProcedureKey {
  std::string_view name;
  double least = 0.0;
  double most = 0.0;
};

// visit(key, value) for each value of the event; `value` is a double, Vector2d or Vector3d, const as the event is.
template <class Event, class Visit>
void visit_keys(Event& event, Visit&& visit) {
  using Kind = std::remove_const_t<Event>;
  if constexpr (std::is_same_v<Kind, Retraction> || std::is_same_v<Kind, Metal>) {
    visit(ProcedureKey{"shift_mm", -60.0, 60.0}, event.shift_mm);
    visit(ProcedureKey{"turn_deg", -45.0, 45.0}, event.turn_deg);
  } else if constexpr (std::is_same_v<Kind, TableTilt>) {
    visit(ProcedureKey{"side_deg", -30.0, 30.0}, event.side_deg);
    visit(ProcedureKey{"head_deg", -30.0, 30.0}, event.head_deg);
  } else if constexpr (std::is_same_v<Kind, Insufflation>) {
    visit(ProcedureKey{"rise_mm", -60.0, 60.0}, event.rise_mm);
    visit(ProcedureKey{"stretch_percent", -20.0, 20.0}, event.stretch_percent);
  } else if constexpr (std::is_base_of_v<Dent, Kind>) {
    visit(ProcedureKey{"place_mm", -60.0, 60.0}, event.place_mm);
    visit(ProcedureKey{"depth_mm", -20.0, 20.0}, event.depth_mm);
    visit(ProcedureKey{"radius_mm", 1.0, 60.0}, event.radius_mm);
  } else if constexpr (std::is_same_v<Kind, ScopeTurnedInHead>) {
    visit(ProcedureKey{"to_deg", -360.0, 360.0}, event.to_deg);
    visit(ProcedureKey{"zoom", 0.5, 2.0}, event.zoom);
  } else if constexpr (std::is_same_v<Kind, Fogged> || std::is_same_v<Kind, Smoke>) {
    visit(ProcedureKey{"density", 0.0, 10.0}, event.density);
  } else if constexpr (std::is_same_v<Kind, Blood>) {
    visit(ProcedureKey{"share", 0.0, 1.0}, event.share);
  } else if constexpr (std::is_same_v<Kind, Electrosurgery>) {
    visit(ProcedureKey{"ecg_mV", 0.0, 100.0}, event.ecg_mV);
    visit(ProcedureKey{"picture_levels", 0.0, 255.0}, event.picture_levels);
    visit(ProcedureKey{"smoke_density", 0.0, 10.0}, event.smoke_density);
    visit(ProcedureKey{"tracker_mm", 0.0, 100.0}, event.tracker_mm);
  } else if constexpr (std::is_same_v<Kind, CameraDelay> || std::is_same_v<Kind, TrackerDelay>) {
    visit(ProcedureKey{"to_ms", -100.0, 100.0}, event.to_ms);
  }
}

// In the order of Happening.
inline constexpr std::array<std::string_view, std::variant_size_v<Happening>> kEventKinds = {
    "retraction",  "table-tilt",  "insufflation", "dent",         "touch",        "scope-turn",     "withdrawn",
    "wiped",       "fogged",      "blood",        "smoke",        "instrument",   "electrosurgery", "metal",
    "tool-hidden", "ectopic-run", "leads-off",    "camera-delay", "tracker-delay"};

// A default one of the kind that stands there.
template <std::size_t I = 0>
[[nodiscard]] Happening happening_of(std::size_t kind) {
  if constexpr (I + 1 < std::variant_size_v<Happening>) {
    if (kind != I) return happening_of<I + 1>(kind);
  }
  return Happening(std::in_place_index<I>);
}

}  // namespace perimap

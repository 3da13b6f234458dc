// What the events of a procedure do to the devices and to the picture at an instant: functions of their arguments
// alone.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"
#include "drivers/standins/procedure/procedure.hpp"

namespace perimap {

// From 0 before the event to 1 at its end, gently.
[[nodiscard]] double come(const ProcedureEvent& event, Duration since) noexcept;
// 0 outside the event, 1 within it, gently over `edge` or a third of the event at its ends.
[[nodiscard]] double within(const ProcedureEvent& event, Duration since, Duration edge) noexcept;

// How far the scope is drawn back along its axis, mm.
[[nodiscard]] double drawn_back_mm(const Procedure& procedure, Duration since) noexcept;

// How the scope is turned and zoomed, from how it was held at first.
struct ScopeAsHeld {
  double notch_deg = 0.0;
  double zoom = 1.0;
};
[[nodiscard]] ScopeAsHeld turned_scope(const Procedure& procedure, const ScopeAsHeld& first, Duration since) noexcept;
// Whether it is being turned just then; the state after `turns` turns otherwise.
struct ScopeTurning {
  bool under_way = false;
  std::size_t turns = 0;  // that have ended
};
[[nodiscard]] ScopeTurning scope_turning(const Procedure& procedure, Duration since) noexcept;

// What is between the scope and the heart.
struct PictureState {
  double trocar = 0.0;        // share of the light that is the trocar's wall
  double cloth = 0.0;         // share that is a cloth
  double fog = 0.0;           // optical depth, the same everywhere
  double smoke = 0.0;         // optical depth of the thickest cloud
  double bands_levels = 0.0;  // of electrosurgery, grey levels
  struct Drop {
    double share = 0.0;        // of the picture
    std::uint64_t number = 0;  // of the event: where it lies
  };
  std::vector<Drop> blood;
  struct Shaft {
    double in = 0.0;           // 0 at the border, 1 at work
    std::uint64_t number = 0;  // of the event: from which side
    bool touches = false;      // its tip is at `place_mm`
    Vector2d place_mm = Vector2d::Zero();
    double depth_mm = 0.0;
  };
  std::vector<Shaft> shafts;
};
[[nodiscard]] PictureState picture_state(const Procedure& procedure, Duration since);

// What comes to the tracker's readings: the same for all within an event of metal, a deviation of each reading's own in
// electrosurgery.
struct TrackerTrouble {
  bool hidden = false;
  Vector3d shift_mm = Vector3d::Zero();
  double turn_rad = 0.0;
  double deviation_mm = 0.0;  // of each axis
};
[[nodiscard]] TrackerTrouble tracker_trouble(const Procedure& procedure, Duration since) noexcept;

[[nodiscard]] bool leads_off(const Procedure& procedure, Duration since) noexcept;
// What electrosurgery adds to a sample of the ECG: noise, and arcs that look like QRS complexes, some six a second.
[[nodiscard]] double arc_mV(const Procedure& procedure, std::uint64_t seed, Duration since,
                            std::int64_t sample) noexcept;

}  // namespace perimap

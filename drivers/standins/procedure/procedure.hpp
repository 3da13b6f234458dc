// What happens in a simulated procedure: a script of events, each with its time.
//
// Lengths in the picture's directions are those of the scope's resting view: right, down, and away from the scope.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// ---- what moves the organ: from where it is to a place, where it stays. All zeros: back to where it was at first.

struct Retraction {
  Vector3d shift_mm = Vector3d::Zero();  // right, down, away
  double turn_deg = 0.0;                 // about the viewing axis, through the place that faces the scope
};

// The operating table with the patient turns about an axis 150 mm behind the heart's surface.
struct TableTilt {
  double side_deg = 0.0;  // about the downward direction: the organ moves to the right
  double head_deg = 0.0;  // about the direction to the right: the organ moves down
};

struct Insufflation {
  double rise_mm = 0.0;          // towards the scope
  double stretch_percent = 0.0;  // about the place that faces the scope
};

// ---- what presses on one place, and lets go within the event

struct Dent {
  Vector2d place_mm = Vector2d::Zero();  // right and down of the place that faces the scope
  double depth_mm = 5.0;                 // away from the scope
  double radius_mm = 12.0;               // nothing moves beyond it
};

// A dent with the tip of an instrument in it.
struct Touch : Dent {};

// ---- the scope

// It is turned in its camera head and zoomed, and stays so.
struct ScopeTurnedInHead {
  double to_deg = 0.0;
  double zoom = 1.0;
};

// It is drawn back into its trocar, and comes back.
struct Withdrawn {};

// A cloth goes over its lens.
struct Wiped {};

// ---- what hides the organ

struct Fogged {
  double density = 2.0;  // optical depth: 1 leaves 37 % of the contrast
};

// On the lens.
struct Blood {
  double share = 0.5;  // of the picture
};

struct Smoke {
  double density = 1.5;  // optical depth of the thickest
};

// A shaft from the picture's border.
struct InstrumentSeen {};

// ---- the other devices

// On the ECG, in the picture, and on an electromagnetic tracker at once.
struct Electrosurgery {
  double ecg_mV = 3.0;           // of its arcs
  double picture_levels = 40.0;  // of bands over the picture, grey levels
  double smoke_density = 0.5;    // at its end
  double tracker_mm = 0.0;       // standard deviation that comes to each axis; 0: the tracker is none of that kind
};

// Metal near an electromagnetic tracker bends its field: poses are off as long as it is there.
struct Metal {
  Vector3d shift_mm = Vector3d::Zero();  // along the axes of the tracker
  double turn_deg = 0.0;
};

// The tracker does not see the scope's sensor.
struct ToolHidden {};

// A stretch of another record, with many ventricular beats, stands in the place of the heart's own rhythm for so long.
struct EctopicRun {};

struct LeadsOff {};

// What a device's data take comes to be so much longer than its stamps allow for, and stays so.
struct CameraDelay {
  double to_ms = 0.0;
};
struct TrackerDelay {
  double to_ms = 0.0;
};

using Happening = std::variant<Retraction, TableTilt, Insufflation, Dent, Touch, ScopeTurnedInHead, Withdrawn, Wiped,
                               Fogged, Blood, Smoke, InstrumentSeen, Electrosurgery, Metal, ToolHidden, EctopicRun,
                               LeadsOff, CameraDelay, TrackerDelay>;

struct ProcedureEvent {
  Duration at{0};      // since the session's start
  Duration length{0};  // what moves the organ, turns the scope or shifts a delay has come to its end then
  Happening what;

  [[nodiscard]] Duration end() const noexcept { return at + length; }
};

// In order of time.
struct Procedure {
  std::vector<ProcedureEvent> events;

  [[nodiscard]] bool empty() const noexcept { return events.empty(); }
  // Whether something of this kind happens.
  template <class Kind>
  [[nodiscard]] bool has() const noexcept {
    for (const ProcedureEvent& event : events)
      if (std::holds_alternative<Kind>(event.what)) return true;
    return false;
  }
};

// As the file calls it: "retraction".
[[nodiscard]] std::string_view kind_of(const Happening& what) noexcept;
// All kinds, in order of the variant.
[[nodiscard]] const std::vector<std::string_view>& kinds_of_events();
// "retraction: shift_mm = [3, -2, 0], turn_deg = 1"
[[nodiscard]] std::string words_of(const ProcedureEvent& event);

// Whether the organ can hardly be seen meanwhile.
[[nodiscard]] bool hides_the_organ(const Happening& what) noexcept;

}  // namespace perimap

// Any bytes as a procedure's file: errors of a line each that name the file, or a procedure that prints and reads back
// as itself, of whose events the effects are finite.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <sstream>
#include <string>
#include <string_view>

#include "drivers/standins/procedure/procedure_effects.hpp"
#include "drivers/standins/procedure/procedure_text.hpp"

namespace {

bool names_the_file_on_every_line(const std::string& message) {
  std::istringstream lines(message + "\n");
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("fuzz.toml:") || line.find('\r') != std::string::npos) return false;
  }
  return true;
}

bool is_finite(const perimap::Procedure& procedure, perimap::Duration since) {
  using namespace perimap;
  const PictureState picture = picture_state(procedure, since);
  const TrackerTrouble tracker = tracker_trouble(procedure, since);
  const ScopeAsHeld scope = turned_scope(procedure, {}, since);
  return std::isfinite(picture.trocar + picture.cloth + picture.fog + picture.smoke + picture.bands_levels) &&
         tracker.shift_mm.allFinite() && std::isfinite(tracker.turn_rad + tracker.deviation_mm) &&
         std::isfinite(scope.notch_deg + scope.zoom) && std::isfinite(drawn_back_mm(procedure, since)) &&
         std::isfinite(arc_mV(procedure, 1, since, 1));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto procedure = parse_procedure(text, "fuzz.toml");
  if (!procedure) {
    if (!names_the_file_on_every_line(procedure.error().message)) std::abort();
    return 0;
  }
  const std::string printed = to_toml(*procedure);
  const auto again = parse_procedure(printed, "again.toml");
  if (!again || to_toml(*again) != printed) std::abort();
  for (const ProcedureEvent& event : procedure->events) {
    for (const Duration since : {event.at, event.at + event.length / 2, event.end()}) {
      if (!is_finite(*procedure, since)) std::abort();
    }
  }
  return 0;
}

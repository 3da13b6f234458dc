// A procedure that a seed draws.
#pragma once

#include <cstdint>

#include "core/time/instant.hpp"
#include "drivers/standins/procedure/procedure.hpp"

namespace perimap {

struct ProcedureDrawing {
  std::uint64_t seed = 1;
  Duration duration = std::chrono::minutes(20);
  bool electromagnetic = false;  // electrosurgery and metal reach the tracker
  bool turns_scope = false;      // a scope whose field stop tells how it is held
  double held_deg = 0.0;         // how it is held then
};

// Kinds come in turn, each once before one comes again, in an order that is drawn; what each does is drawn too. The
// first begins after 40 s, in which the map is made. Between the end of one and the beginning of the next are 20 to 45
// s, so that what is said of each can be told apart, and none begins later than 20 s before the end. An organ that was
// moved is brought back by the next event of its kind. A function of its arguments alone.
[[nodiscard]] Procedure draw_procedure(const ProcedureDrawing& drawing);

}  // namespace perimap

// What is believed of the set-up, as it outlives a crash.
#pragma once

#include "core/setup_watch/setup_verdict.hpp"

namespace perimap {

struct SetupMemory {
  bool asked = false;  // some window has told of it
  bool doubted = false;
  SetupVerdict told;           // as SetupBelief::told()
  double widening_mm = 0.0;    // by the windows, beside what a doubt widens
  double widened_at_mm = 0.0;  // the surface's deviation in the window that it is of
};

}  // namespace perimap

// The cardiac phase that the matches of one frame showed.
#pragma once

#include "core/time/instant.hpp"

namespace perimap {

struct ObservedPhase {
  Instant time;
  double phase_rad = 0.0;  // any multiple of 2 pi added
  double deviation_rad = 0.0;
};

}  // namespace perimap

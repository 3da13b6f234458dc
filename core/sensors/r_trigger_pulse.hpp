// A monitor's R-wave pulse, as it came: an edge of a trigger line.
#pragma once

#include <cstdint>

#include "core/time/instant.hpp"

namespace perimap {

struct RTriggerPulse {
  Instant time;  // of the edge
  Instant arrival;
  std::uint32_t device_count = 0;  // of the edges; a gap is a lost pulse
};

}  // namespace perimap

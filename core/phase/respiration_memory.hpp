// What is known of breathing, as a value: it outlives a crash together with the map, whose coefficients count breathing
// from where the phase of this clock was zero.
#pragma once

#include "core/phase/respiration_search.hpp"
#include "core/phase/respiratory_clock.hpp"

namespace perimap {

struct RespirationMemory {
  bool found = false;         // breathing was locked on to, now or earlier: the wave means something
  BreathWave wave;            // the displacement in common, in the clock's phase
  RespiratoryClock clock;     // locked only where it was found
  bool offset_known = false;  // of what follows
  double offset_rad = 0.0;    // the clock's phase minus the respiration channel's
};

}  // namespace perimap

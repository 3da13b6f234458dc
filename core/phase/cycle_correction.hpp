// What is known of the running cardiac cycle, and of the next where its R peak is not known yet, beyond the ECG.
#pragma once

#include <cstdint>

#include "core/time/instant.hpp"

namespace perimap {

struct CycleCorrection {
  std::uint64_t beats = 0;  // CardiacClock::beats() during the cycle that this is about; 0: nothing is known
  Instant begin;
  Duration begin_deviation{0};
  Duration given_way{0};  // `begin` lies so much after the R peak, see CyclePosterior
  Duration length{0};
  Duration length_deviation{0};
  Duration next_length{0};  // of the cycle after it; 0: nothing is known
  Duration next_length_deviation{0};
  bool contradicted = false;  // the images show another phase than this; the deviation has been widened
  // The ECG tells nothing: the images carry the phase on. `beats` counts those known when they began to.
  bool carried = false;
  int ahead = 0;                // carried: this many cycles after the one that began with the last of `beats`
  Duration previous_length{0};  // carried: of the cycle before this one
  bool seen = false;            // carried, and the images have told the phase lately
};

}  // namespace perimap

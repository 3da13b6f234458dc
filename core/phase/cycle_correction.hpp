// What is known of the running cardiac cycle, and of the next where its R peak is not known yet, beyond the ECG.
#pragma once

#include <cstdint>

#include "core/time/instant.hpp"

namespace perimap {

struct CycleCorrection {
  std::uint64_t beats = 0;  // CardiacClock::beats() during the cycle that this is about; 0: nothing is known
  Instant begin;            // the R peak
  Duration begin_deviation{0};
  Duration length{0};
  Duration length_deviation{0};
  Duration next_length{0};  // of the cycle after it; 0: nothing is known
  Duration next_length_deviation{0};
  bool contradicted = false;  // the images show another phase than this; the deviation has been widened
};

}  // namespace perimap

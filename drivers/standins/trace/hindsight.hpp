// What the phases of a recorded heart were, by a fit to all of its motion.
#pragma once

#include <vector>

#include "drivers/standins/trace/motion_trace.hpp"
#include "drivers/standins/trace/phase_smoother.hpp"

namespace perimap {

struct Hindsight {
  PhaseTracks phases;           // of each sample
  std::vector<double> beats_s;  // on the trace's clock: when cycles begin, some time before the heart moves fastest
  double breath_mm = 0.0;       // RMS of the displacement by breathing alone, of the mean of the points
};

// Fits heart and breathing, rates first, then the course of both phases, alternating with a map of both. Refuses a
// trace that is shorter than six seconds.
[[nodiscard]] Expected<Hindsight> in_hindsight(const MotionTrace& trace);

}  // namespace perimap

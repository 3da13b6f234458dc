// The simulated heart's laws of motion as the pipeline calls them.
#pragma once

#include "core/phase/phase_law.hpp"
#include "drivers/standins/truth/heart_motion.hpp"

namespace perimap::test {

[[nodiscard]] inline const char* name_of(PhaseLaw law) {
  switch (law) {
    case PhaseLaw::kWarped:
      return "warped";
    case PhaseLaw::kTimeLocked:
      return "time-locked";
    case PhaseLaw::kLinear:
      break;
  }
  return "linear";
}

[[nodiscard]] inline PhaseLaw law_of(MotionLaw law) {
  switch (law) {
    case MotionLaw::kWarped:
      return PhaseLaw::kWarped;
    case MotionLaw::kTimeLocked:
      return PhaseLaw::kTimeLocked;
    case MotionLaw::kLinear:
      break;
  }
  return PhaseLaw::kLinear;
}

}  // namespace perimap::test

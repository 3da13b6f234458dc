// What the images of one frame tell of a phase: that of the heart, or that of breathing.
#pragma once

#include <cstdint>

#include "core/phase/observed_phase.hpp"

namespace perimap {

enum class ImagePhaseOutcome : std::uint8_t {
  kObserved,
  kTentative,  // observed, but by a map that has not converged: its phase may be off by what the map gets wrong
  kCanNotTell,
  kContradicts
};

struct ImagePhaseAnswer {
  ImagePhaseOutcome outcome = ImagePhaseOutcome::kCanNotTell;
  ObservedPhase observed;  // when kObserved or kTentative
};

}  // namespace perimap

// What is known of the law that the heart's motion follows, to go on from.
#pragma once

#include <array>

#include "core/phase/phase_law.hpp"
#include "core/phase/seconds.hpp"

namespace perimap {

struct LawMemory {
  PhaseLaw law = PhaseLaw::kLinear;
  Seconds usual{0.0};   // length of the cycle in which the laws are even; 0: nothing was weighed
  double cycles = 0.0;  // weighed, older ones faded, here and in the squares
  std::array<double, kPhaseLaws.size()> squares{};
  std::array<double, kPhaseLaws.size()> log_likelihoods{};  // of all that was weighed, trials too
};

}  // namespace perimap

// How well each law explains what was seen of one feature over some cycles whose ends are known: a motion of its own
// was fitted to the same matches under each.
#pragma once

#include <array>

#include "core/phase/phase_law.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct LawTrial {
  std::array<double, kPhaseLaws.size()>
      costs{};    // -2 log posterior of the best motion, by Student's likelihood; a constant off
  Instant begin;  // of the first match
  Instant end;    // of the last
};

}  // namespace perimap

// What the mapper believes of the phases, a cell for each reader.
#pragma once

#include "core/phase/phase_belief.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/realtime/triple_buffer.hpp"

namespace perimap {

struct PhaseCells {
  TripleBuffer<PhaseBelief> publisher_heart;
  TripleBuffer<PhaseBelief> status_heart;
  TripleBuffer<RespiratoryClock> publisher_breath;
  TripleBuffer<RespiratoryClock> status_breath;
};

}  // namespace perimap

// The mapper's word on the phases, a cell for each reader.
#pragma once

#include "core/phase/cycle_correction.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/realtime/triple_buffer.hpp"

namespace perimap {

struct PhaseCells {
  TripleBuffer<CycleCorrection> publisher_correction;
  TripleBuffer<CycleCorrection> status_correction;
  TripleBuffer<RespiratoryClock> publisher_respiration;
  TripleBuffer<RespiratoryClock> status_respiration;
};

}  // namespace perimap

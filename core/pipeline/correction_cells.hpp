// The mapper's word on the running cycle, a cell for each reader.
#pragma once

#include "core/phase/cycle_correction.hpp"
#include "core/realtime/triple_buffer.hpp"

namespace perimap {

struct CorrectionCells {
  TripleBuffer<CycleCorrection> publisher;
  TripleBuffer<CycleCorrection> status;
};

}  // namespace perimap

// How many features are in which state of their lives, for the status.
#pragma once

#include <span>

#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_doubts.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// Mapper thread, while the workers are at rest. `seen`: the capture of the last frame, `doubts` of it; `matches_needed`
// for a start.
void count_states(std::span<const FeatureSlot> slots, Instant seen, const FrameDoubts& doubts, int matches_needed,
                  PipelineCounters& counters) noexcept;

}  // namespace perimap

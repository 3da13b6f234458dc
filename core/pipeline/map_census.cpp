#include "core/pipeline/map_census.hpp"

#include <cstdint>

#include "core/pipeline/feature_stages.hpp"
#include "core/pipeline/start_progress.hpp"

namespace perimap {

void count_states(std::span<const FeatureSlot> slots, Instant seen, const FrameDoubts& doubts, int matches_needed,
                  PipelineCounters& counters) noexcept {
  std::uint64_t starting = 0;
  std::uint64_t converging = 0;
  std::uint64_t converged = 0;
  std::uint64_t inconsistent = 0;
  for (const FeatureSlot& slot : slots) {
    if (slot.state == SlotState::kStarting) ++starting;
    if (slot.state != SlotState::kMapped) continue;
    if (slot.pressed || slot.health.state() == HealthState::kInconsistent) {
      ++inconsistent;
    } else if (is_called_converged(slot, seen, doubts)) {
      ++converged;
    } else {
      ++converging;
    }
  }
  const StartProgress progress = start_progress(slots, matches_needed);
  counters.features_tracked.set(progress.features);
  counters.start_matches_most.set(progress.most_matches);
  counters.start_matches_mean.set(progress.mean_matches);
  counters.features_starting.set(starting);
  counters.features_converging.set(converging);
  counters.features_converged.set(converged);
  counters.features_inconsistent.set(inconsistent);
}

}  // namespace perimap

// How far the features that have no map yet are on the way to their starts.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "core/pipeline/feature_slot.hpp"

namespace perimap {

// Of the tracked features; zeros when there are none. A feature with all the matches that it needs waits for the end of
// the last one's cycle.
struct StartProgress {
  std::uint64_t features = 0;
  std::uint64_t most_matches = 0;  // held by one of them, at most as many as are needed
  std::uint64_t mean_matches = 0;  // rounded down
};

[[nodiscard]] inline StartProgress start_progress(std::span<const FeatureSlot> slots, int needed) noexcept {
  StartProgress progress;
  std::uint64_t sum = 0;
  for (const FeatureSlot& slot : slots) {
    if (slot.state != SlotState::kTracked) continue;
    const auto held = std::min<std::uint64_t>(slot.held.size(), static_cast<std::uint64_t>(needed));
    ++progress.features;
    progress.most_matches = std::max(progress.most_matches, held);
    sum += held;
  }
  if (progress.features > 0) progress.mean_matches = sum / progress.features;
  return progress;
}

}  // namespace perimap

// How far the features that have no map yet are on the way to their starts.
#pragma once

#include <algorithm>
#include <cstddef>
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

// Of more features than have an estimate: then it is what all have in common that is wrong (no parallax, another
// heart's ECG, a wrong set-up), not what the single feature follows.
[[nodiscard]] inline bool starts_fail_alike(std::span<const FeatureSlot> slots) noexcept {
  std::ptrdiff_t failing = 0, mapped = 0;
  for (const FeatureSlot& slot : slots) {
    const bool is_unmapped = slot.state == SlotState::kTracked || slot.state == SlotState::kStarting;
    failing += is_unmapped && slot.failed_starts > 0 ? 1 : 0;
    mapped += slot.state == SlotState::kMapped ? 1 : 0;
  }
  return failing > mapped;
}

}  // namespace perimap

// Whether the images still show what is mapped. A surface that they do not show is what the ECG and the map say, and
// nothing would tell that the organ has been moved.
#pragma once

#include <algorithm>
#include <cstddef>

#include "core/pipeline/image_phase.hpp"
#include "core/pipeline/shard_snapshot.hpp"

namespace perimap {

class Sight {
 public:
  // One feature is in sight that agreed with the map so shortly before its shard's frame: longer than smoke or blur of
  // a few frames, shorter than a heart beat.
  static constexpr Duration kLately = std::chrono::milliseconds(500);
  // With fewer in sight the images can not contradict the phase either.
  static constexpr std::size_t kEnough = ImagePhase::kFewestMatches;

  void add(const ShardSnapshot& shard) noexcept {
    mapped_ += shard.features.size();
    seen_ += static_cast<std::size_t>(std::count_if(
        shard.features.begin(), shard.features.end(),
        [&](const FeatureSnapshot& feature) { return shard.capture - feature.last_observed <= kLately; }));
  }

  // Of a map with few features half must be in sight.
  [[nodiscard]] bool lost() const noexcept { return seen_ < std::min(kEnough, (mapped_ + 1) / 2); }

 private:
  std::size_t mapped_ = 0, seen_ = 0;
};

}  // namespace perimap

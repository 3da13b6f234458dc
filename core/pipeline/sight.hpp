// Whether the images still show what is mapped. A surface that they do not show is what the ECG and the map say, and
// nothing would tell that the organ has been moved.
#pragma once

#include <algorithm>
#include <cstddef>

#include "core/pipeline/shard_snapshot.hpp"

namespace perimap {

// Of features called converged alone: one that is not agrees with almost any match.
class Sight {
 public:
  // So long after it agreed with the map a feature is still in sight: longer than smoke or blur of a few frames,
  // shorter than a heart beat.
  static constexpr Duration kLately = std::chrono::milliseconds(500);
  // As many must be in sight wherever so many are twice expected; of more a third, since chance finds some.
  static constexpr std::size_t kEnough = 8;

  void add(const ShardSnapshot& shard) noexcept {
    for (const FeatureSnapshot& feature : shard.features) {
      if (feature.state != FeatureState::kConverged) continue;
      ++converged_;
      expected_ += feature.expected ? 1 : 0;
      seen_ += feature.in_sight ? 1 : 0;
    }
  }

  [[nodiscard]] bool lost() const noexcept {
    const std::size_t some = std::max({std::size_t{1}, std::min(kEnough, (expected_ + 1) / 2), (expected_ + 2) / 3});
    return converged_ > 0 && seen_ < some;
  }

 private:
  std::size_t converged_ = 0, expected_ = 0, seen_ = 0;
};

}  // namespace perimap

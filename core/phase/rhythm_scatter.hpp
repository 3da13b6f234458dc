// How far the intervals of usual beats lie from the rhythm's cycle.
#pragma once

#include <algorithm>
#include <cmath>

namespace perimap {

class RhythmScatter {
 public:
  // log(interval / cycle).
  void learn(double log_rr) noexcept { mean_ += (std::min(std::abs(log_rr), kFarOff) - mean_) / kMemory; }
  // Fading mean of its magnitude.
  [[nodiscard]] double mean() const noexcept { return mean_; }

 private:
  static constexpr double kAtFirst = 0.1;
  static constexpr double kFarOff = 0.5;   // a pause or a missed beat: whatever is farther counts as much
  static constexpr double kMemory = 24.0;  // beats

  double mean_ = kAtFirst;
};

}  // namespace perimap

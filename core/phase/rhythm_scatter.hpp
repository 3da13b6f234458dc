// How far the intervals of usual beats lie from the rhythm's cycle.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/phase/recent_values.hpp"

namespace perimap {

class RhythmScatter {
 public:
  // log(interval / cycle).
  void learn(double log_rr) noexcept {
    mean_ += (std::min(std::abs(log_rr), kFarOff) - mean_) / kMemory;
    last_.push(std::abs(log_rr));
  }
  // Fading mean of its magnitude.
  [[nodiscard]] double mean() const noexcept { return mean_; }
  // Hardly at all: no sinus node keeps its interval as a pacemaker does.
  [[nodiscard]] bool like_clockwork() const noexcept { return last_.count() == kLast && last_.median() < kClockwork; }

 private:
  static constexpr double kAtFirst = 0.1;
  static constexpr double kFarOff = 0.5;   // a pause or a missed beat: whatever is farther counts as much
  static constexpr double kMemory = 24.0;  // beats

  static constexpr int kLast = 8;
  static constexpr double kClockwork = 0.008;  // the calmest of the development records has 0.008 at its calmest (dev)

  double mean_ = kAtFirst;
  RecentValues<kLast> last_;
};

}  // namespace perimap

// Does a feature's filter explain what it sees? Follows the mean of its normalised innovation squared (NIS).
//
// A consistent filter's NIS is chi-squared with 2 degrees of freedom, so NIS/2 has mean 1 and variance 1. Its
// exponential mean over a memory of N updates has standard deviation sqrt(1 / (2 N - 1)): 0.13 for N = 30. That is of
// independent innovations. Those of one cardiac cycle share the errors of its R peaks; where these are a good part of
// them, the mean scatters like that of a few cycles, and the limits are as much wider.
#pragma once

#include <cstdint>

namespace perimap {

struct InnovationMonitorSettings {
  double memory_updates = 30.0;   // N; at least 1
  int enough_updates = 20;        // no verdict before
  double consistent_below = 1.6;  // mean NIS/2 of independent updates; 4.6 standard deviations above 1 for N = 30
  double high_above = 2.0;        // drift, wrong phase, wrong noise: 7.7 standard deviations
  double largest_nis = 13.8;      // an outlier counts no more than this: chi-squared, 2 degrees, 99.9 %
};

enum class InnovationVerdict : std::uint8_t { kTooFew, kConsistent, kElevated, kHigh };

class InnovationMonitor {
 public:
  explicit InnovationMonitor(const InnovationMonitorSettings& settings = {}) noexcept : settings_(settings) {}

  // The NIS of an update, accepted or rejected by the gate. NaN counts as an outlier. `common`: which part of the
  // measurement's variance, in the direction where that is the largest, comes from an error common to its cycle; 0..1.
  // A map that is little known adds to the innovation's: then it is more than its part of that, and limits too wide.
  void add(double nis, double common = 0.0) noexcept;
  // The updates to come are of another cycle. They share next to nothing with those so far: an R peak ends a cycle and
  // begins the next, at phases where it counts little for one of the two.
  void begin_cycle() noexcept { common_ = 0.0; }
  void reset() noexcept;

  // Mean of NIS/2, 1 when the filter is consistent, 0 before the first update. While fewer than N updates have been
  // seen it is their plain mean.
  [[nodiscard]] double mean() const noexcept { return mean_; }
  [[nodiscard]] int count() const noexcept { return count_; }
  // Whether the mean is above a limit that is meant for independent updates.
  [[nodiscard]] bool above(double limit) const noexcept;
  [[nodiscard]] InnovationVerdict verdict() const noexcept;
  [[nodiscard]] bool consistent() const noexcept { return verdict() == InnovationVerdict::kConsistent; }
  [[nodiscard]] bool high() const noexcept { return verdict() == InnovationVerdict::kHigh; }

 private:
  InnovationMonitorSettings settings_;
  double mean_ = 0.0;
  double variance_ = 0.0;     // of the mean, were the filter consistent
  double independent_ = 0.0;  // the same, were its updates independent as well
  double common_ = 0.0;       // of the mean with the common error of the cycle
  int count_ = 0;             // stops counting at a million
};

}  // namespace perimap

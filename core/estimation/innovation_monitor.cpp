#include "core/estimation/innovation_monitor.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {

void InnovationMonitor::add(double nis, double common) noexcept {
  constexpr int kCountLimit = 1'000'000;
  count_ = std::min(count_ + 1, kCountLimit);
  const double clipped = nis >= 0.0 ? std::min(nis, settings_.largest_nis) : settings_.largest_nis;
  const double weight = 1.0 / std::min(static_cast<double>(count_), settings_.memory_updates);
  mean_ += weight * (0.5 * clipped - mean_);

  // Two updates with a common error in one of their two directions: NIS/2 has the covariance common_i common_j / 2.
  const double kept = 1.0 - weight;
  variance_ = kept * kept * variance_ + kept * weight * common * common_ + weight * weight;
  independent_ = kept * kept * independent_ + weight * weight;
  common_ = kept * common_ + weight * common;
}

void InnovationMonitor::reset() noexcept {
  mean_ = 0.0;
  variance_ = 0.0;
  independent_ = 0.0;
  common_ = 0.0;
  count_ = 0;
}

bool InnovationMonitor::above(double limit) const noexcept {
  return count_ > 0 && mean_ > 1.0 + (limit - 1.0) * std::sqrt(variance_ / independent_);
}

InnovationVerdict InnovationMonitor::verdict() const noexcept {
  if (count_ < settings_.enough_updates) return InnovationVerdict::kTooFew;
  if (!above(settings_.consistent_below)) return InnovationVerdict::kConsistent;
  return above(settings_.high_above) ? InnovationVerdict::kHigh : InnovationVerdict::kElevated;
}

}  // namespace perimap

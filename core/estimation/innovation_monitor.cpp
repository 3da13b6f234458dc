#include "core/estimation/innovation_monitor.hpp"

#include <algorithm>

namespace perimap {

void InnovationMonitor::add(double nis) noexcept {
  constexpr int kCountLimit = 1'000'000;
  count_ = std::min(count_ + 1, kCountLimit);
  const double clipped = nis >= 0.0 ? std::min(nis, settings_.largest_nis) : settings_.largest_nis;
  const double weight = 1.0 / std::min(static_cast<double>(count_), settings_.memory_updates);
  mean_ += weight * (0.5 * clipped - mean_);
}

void InnovationMonitor::reset() noexcept {
  mean_ = 0.0;
  count_ = 0;
}

InnovationVerdict InnovationMonitor::verdict() const noexcept {
  if (count_ < settings_.enough_updates) return InnovationVerdict::kTooFew;
  if (mean_ <= settings_.consistent_below) return InnovationVerdict::kConsistent;
  return mean_ > settings_.high_above ? InnovationVerdict::kHigh : InnovationVerdict::kElevated;
}

}  // namespace perimap

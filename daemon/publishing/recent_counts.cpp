#include "daemon/publishing/recent_counts.hpp"

#include <algorithm>

namespace perimap {
namespace {

constexpr Duration kStep = std::chrono::seconds(1);
constexpr auto kMoments = static_cast<std::size_t>(RecentCounts::kWindow / kStep) + 1;

}  // namespace

RecentCounts::RecentCounts() { moments_.reserve(kMoments); }

void RecentCounts::note(const PipelineCounters& counters, Instant now) {
  const std::lock_guard lock(mutex_);
  if (!moments_.empty() && now - moments_.back().time < kStep) return;
  if (moments_.size() < kMoments) {
    moments_.emplace_back();
  } else {
    std::rotate(moments_.begin(), moments_.begin() + 1, moments_.end());
  }
  CountsThen& moment = moments_.back();
  moment.time = now;
  for (std::size_t i = 0; i < kStatusStages.size(); ++i) {
    moment.stages[i] = (counters.*kStatusStages[i].histogram).counts();
  }
  for (std::size_t i = 0; i < kStatusSources.size(); ++i) {
    moment.received[i] = (counters.*kStatusSources[i].received).get();
  }
}

std::optional<CountsThen> RecentCounts::then() const {
  const std::lock_guard lock(mutex_);
  if (moments_.empty()) return std::nullopt;
  return moments_.front();
}

}  // namespace perimap

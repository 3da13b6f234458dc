#include "daemon/evaluation/bench/figures.hpp"

#include <algorithm>
#include <unordered_set>

#include "core/realtime/deadline.hpp"

namespace perimap::bench {
namespace {

// The smallest of the sorted values that a share of per_mille / 1000 does not exceed.
Duration nearest_rank(const std::vector<Duration>& sorted, std::size_t per_mille) {
  const std::size_t rank = (sorted.size() * per_mille + 999) / 1000;
  return sorted[std::max<std::size_t>(rank, 1) - 1];
}

}  // namespace

Figures figures_of(std::vector<Duration> durations) {
  Figures figures;
  if (durations.empty()) return figures;
  std::sort(durations.begin(), durations.end());
  figures.count = durations.size();
  figures.p50 = nearest_rank(durations, 500);
  figures.p99 = nearest_rank(durations, 990);
  figures.p999 = nearest_rank(durations, 999);
  figures.max = durations.back();
  const auto late = std::upper_bound(durations.begin(), durations.end(), kOnTime);
  figures.on_time = static_cast<double>(late - durations.begin()) / static_cast<double>(durations.size());
  return figures;
}

std::uint64_t missing_numbers(std::span<const std::uint64_t> sent, std::span<const std::uint64_t> received) {
  const std::unordered_set<std::uint64_t> came(received.begin(), received.end());
  return static_cast<std::uint64_t>(
      std::count_if(sent.begin(), sent.end(), [&](std::uint64_t number) { return !came.contains(number); }));
}

}  // namespace perimap::bench

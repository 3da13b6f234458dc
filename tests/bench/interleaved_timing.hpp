// Times several ways of doing the same work in turn, round by round, so that what disturbs the machine disturbs all.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <string>
#include <vector>

namespace perimap::bench {

struct Candidate {
  std::string name;
  double updates = 1.0;  // that one call makes
  std::function<void()> call;
  std::vector<double> ns_per_update;  // of each round

  Candidate(std::string name_of, double updates_of, std::function<void()> call_of)
      : name(std::move(name_of)), updates(updates_of), call(std::move(call_of)) {}

  // The value that a fraction of the rounds does not exceed.
  [[nodiscard]] double quantile(double fraction) const {
    std::vector<double> sorted = ns_per_update;
    std::sort(sorted.begin(), sorted.end());
    return sorted[static_cast<std::size_t>(fraction * static_cast<double>(sorted.size() - 1) + 0.5)];
  }
  [[nodiscard]] double median() const { return quantile(0.5); }
};

inline double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Every candidate runs once before it is timed in each round, because the ones between have taken its place in the
// caches.
inline void time_interleaved(std::vector<Candidate>& candidates, int rounds) {
  for (int round = 0; round < rounds; ++round) {
    for (Candidate& candidate : candidates) {
      candidate.call();
      const auto start = std::chrono::steady_clock::now();
      candidate.call();
      candidate.ns_per_update.push_back(1e9 * seconds_since(start) / candidate.updates);
    }
  }
}

}  // namespace perimap::bench

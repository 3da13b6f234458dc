// Times several ways of doing the same work in turn, round by round, so that what disturbs the machine disturbs all.
#pragma once

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

namespace perimap::bench {

// The value that a fraction of the values does not exceed; not a number when there are none.
[[nodiscard]] inline double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1) + 0.5)];
}

struct Candidate {
  std::string name;
  double updates = 1.0;  // that one call makes
  std::function<void()> call;
  std::function<void()> prepare;          // before the call that is timed; may be empty
  int calls = 1;                          // on end, timed together
  std::vector<double> ns_per_update;      // of each round, by the clock on the wall
  std::vector<double> cpu_ns_per_update;  // of each round, of the calling thread

  Candidate(std::string name_of, double updates_of, std::function<void()> call_of)
      : name(std::move(name_of)), updates(updates_of), call(std::move(call_of)) {}

  // Over the rounds.
  [[nodiscard]] double quantile(double fraction) const { return bench::quantile(ns_per_update, fraction); }
  [[nodiscard]] double median() const { return quantile(0.5); }
  [[nodiscard]] double cpu_quantile(double fraction) const { return bench::quantile(cpu_ns_per_update, fraction); }
  [[nodiscard]] double cpu_median() const { return cpu_quantile(0.5); }
};

// What the calling thread has used of a processor: time in which others had it does not count.
inline double thread_seconds() {
  timespec now{};
  (void)clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

inline double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// What reading the thread's clock adds to what lies between two readings.
inline double thread_clock_seconds() {
  std::vector<double> readings;
  for (int i = 0; i < 301; ++i) {
    const double start = thread_seconds();
    readings.push_back(thread_seconds() - start);
  }
  return quantile(readings, 0.5);
}

// Every candidate runs once before it is timed in each round, because the ones between have taken its place in the
// caches. Short ones without preparation run several times on end, and what reading the clock takes is subtracted.
inline void time_interleaved(std::vector<Candidate>& candidates, int rounds) {
  constexpr double kLongEnough_s = 100e-6;
  constexpr int kMostCalls = 16;
  const double clock_s = thread_clock_seconds();
  for (int round = 0; round < rounds; ++round) {
    for (Candidate& candidate : candidates) {
      const double warm_start = thread_seconds();
      candidate.call();
      const double warm_s = thread_seconds() - warm_start;
      if (round == 0 && !candidate.prepare) {
        candidate.calls = static_cast<int>(std::clamp(kLongEnough_s / warm_s, 1.0, double{kMostCalls}));
      }
      if (candidate.prepare) candidate.prepare();
      const auto start = std::chrono::steady_clock::now();
      const double cpu_start = thread_seconds();
      for (int i = 0; i < candidate.calls; ++i) candidate.call();
      const double cpu_s = thread_seconds() - cpu_start - clock_s;
      const double updates = candidate.updates * candidate.calls;
      candidate.cpu_ns_per_update.push_back(1e9 * cpu_s / updates);
      candidate.ns_per_update.push_back(1e9 * seconds_since(start) / updates);
    }
  }
}

}  // namespace perimap::bench

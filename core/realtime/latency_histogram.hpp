// Counts durations in log-linear buckets, written by one thread, read by any.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstdint>

#include "core/time/instant.hpp"

namespace perimap {

// Buckets: 16 linear steps within every power of two of nanoseconds, so a figure is right to 1/16 (6 %) from 1 ns to
// 18 minutes. Negative durations count as zero.
class LatencyHistogram {
 public:
  struct Summary {
    std::uint64_t count = 0;
    Duration p50{0};
    Duration p99{0};
    Duration p999{0};
    Duration max{0};
  };

 private:
  static constexpr unsigned kSteps = 16;
  static constexpr unsigned kPowers = 40;
  static constexpr std::size_t kBuckets = kSteps * (kPowers - 3);

 public:
  // How many durations each bucket had at some moment.
  using Counts = std::array<std::uint64_t, kBuckets>;

  // Writer only. Wait-free.
  void add(Duration duration) noexcept {
    const auto ns = static_cast<std::uint64_t>(std::max<std::int64_t>(0, duration.count()));
    // Relaxed throughout: each count is a statistic of its own and orders nothing else. One writer, so load-add-store
    // loses nothing. A reader may see a sample in a bucket and not yet in the maximum; both are true a moment later.
    bump(buckets_[bucket_of(ns)]);
    if (ns > max_.load(std::memory_order_relaxed)) max_.store(ns, std::memory_order_relaxed);
  }

  // Any thread.
  [[nodiscard]] Counts counts() const noexcept {
    Counts counts;
    for (std::size_t i = 0; i < kBuckets; ++i) counts[i] = buckets_[i].load(std::memory_order_relaxed);
    return counts;
  }

  // Of all since the beginning; the maximum is exact.
  [[nodiscard]] Summary summary() const noexcept {
    return summarize(counts(), Duration(max_.load(std::memory_order_relaxed)));
  }

  // Of what came between two moments; the maximum too is right to 1/16 only. `before` must be older than `after`.
  [[nodiscard]] static Summary between(const Counts& before, const Counts& after) noexcept {
    Counts came;
    Duration max{0};
    for (std::size_t i = 0; i < kBuckets; ++i) {
      came[i] = after[i] - before[i];
      if (came[i] > 0) max = Duration(static_cast<std::int64_t>(upper_edge(i)));
    }
    return summarize(came, max);
  }

 private:
  static void bump(std::atomic<std::uint64_t>& count) noexcept {
    count.store(count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }

  static std::size_t bucket_of(std::uint64_t ns) noexcept {
    if (ns < kSteps) return static_cast<std::size_t>(ns);
    const auto power = static_cast<unsigned>(std::bit_width(ns)) - 5;  // ns >> power lies in [16, 32)
    const std::size_t index = kSteps * (power + 1) + ((ns >> power) - kSteps);
    return std::min(index, kBuckets - 1);
  }

  static std::uint64_t upper_edge(std::size_t bucket) noexcept {
    if (bucket < kSteps) return bucket;
    const std::size_t power = bucket / kSteps - 1;
    return ((kSteps + bucket % kSteps + 1) << power) - 1;
  }

  static Summary summarize(const Counts& counts, Duration max) noexcept {
    Summary s;
    for (const std::uint64_t count : counts) s.count += count;
    s.max = max;
    s.p50 = std::min(quantile(counts, s.count, 0.50), max);
    s.p99 = std::min(quantile(counts, s.count, 0.99), max);
    s.p999 = std::min(quantile(counts, s.count, 0.999), max);
    return s;
  }

  static Duration quantile(const Counts& counts, std::uint64_t total, double q) noexcept {
    const double rank = q * static_cast<double>(total);
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < kBuckets; ++i) {
      sum += counts[i];
      if (sum > 0 && static_cast<double>(sum) >= rank) return Duration(static_cast<std::int64_t>(upper_edge(i)));
    }
    return Duration(0);
  }

  std::array<std::atomic<std::uint64_t>, kBuckets> buckets_{};
  std::atomic<std::uint64_t> max_{0};
};

}  // namespace perimap

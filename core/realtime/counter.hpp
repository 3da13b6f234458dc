// A count that one thread raises and any thread reads.
#pragma once

#include <atomic>
#include <cstdint>

namespace perimap {

class Counter {
 public:
  void add(std::uint64_t n = 1) noexcept {
    // Relaxed: a statistic that orders nothing; one writer, so load-add-store loses no count.
    value_.store(value_.load(std::memory_order_relaxed) + n, std::memory_order_relaxed);
  }
  void set(std::uint64_t n) noexcept { value_.store(n, std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t get() const noexcept { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> value_{0};
};

}  // namespace perimap

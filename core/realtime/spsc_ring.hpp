// A bounded queue between exactly one producer thread and one consumer thread.
#pragma once

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstddef>
#include <cstdint>

namespace perimap {

// Wait-free; all memory at construction. "Full" is a return value and is counted, never hidden.
// push() and its count belong to the producer, pop() to the consumer; refused() may be read by anyone.
template <class T>
class SpscRing {
 public:
  explicit SpscRing(std::size_t capacity) : queue_(capacity) {}

  // False when the ring is full; the value is then not taken and the refusal is counted.
  [[nodiscard]] bool push(const T& value) noexcept {
    if (queue_.push(value)) return true;
    // Relaxed: a statistic that orders nothing; one writer, so load-add-store loses no count.
    refused_.store(refused_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    return false;
  }

  [[nodiscard]] bool pop(T& value) noexcept { return queue_.pop(value); }

  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_.load(std::memory_order_relaxed); }

 private:
  boost::lockfree::spsc_queue<T> queue_;
  std::atomic<std::uint64_t> refused_{0};
};

}  // namespace perimap

// A bounded queue of bytes between exactly one producer thread and one consumer thread.
#pragma once

#include <boost/lockfree/spsc_queue.hpp>
#include <cstddef>
#include <span>
#include <vector>

namespace perimap {

// Wait-free; all memory at construction, and touched there, so that no later page fault takes time.
class SpscByteRing {
 public:
  explicit SpscByteRing(std::size_t capacity) : queue_(capacity) {
    std::vector<std::byte> block(std::size_t{1} << 16U);
    for (std::size_t touched = 0; touched <= capacity; touched += block.size()) {
      const std::size_t put = queue_.push(block.data(), block.size());
      (void)queue_.pop(block.data(), put);
    }
  }

  // All of the bytes or, when there is no room, none.
  [[nodiscard]] bool push(std::span<const std::byte> bytes) noexcept {
    if (queue_.write_available() < bytes.size()) return false;
    (void)queue_.push(bytes.data(), bytes.size());
    return true;
  }

  // As many as were pushed, in any pieces.
  void pop(std::span<std::byte> bytes) noexcept { (void)queue_.pop(bytes.data(), bytes.size()); }

 private:
  boost::lockfree::spsc_queue<std::byte> queue_;
};

}  // namespace perimap

// The mapped features, a few at a time, from the mapper to whoever keeps them.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/pipeline/map_memory.hpp"
#include "core/realtime/wakeup.hpp"

namespace perimap {

// A hand-over of one batch: the mapper fills it when the reader has done with the last, else passes it by. Slots come
// in order, round and round. One writer, one reader; nothing is allocated after construction.
class MapFeed {
 public:
  static constexpr std::size_t kSlotsABatch = 2;

  struct Entry {
    std::size_t slot = 0;
    bool mapped = false;               // false: there is nothing in this slot, and `feature` means nothing
    std::uint64_t maps_forgotten = 0;  // the count of then: an entry of a map that was forgotten since is void
    FeatureMemory feature;
  };

  // Mapper: the entries to fill; none while the reader has them.
  [[nodiscard]] std::span<Entry> back() noexcept {
    // Acquire: the reader's reads of the entries happen before they are filled again.
    if (full_.load(std::memory_order_acquire)) return {};
    return entries_;
  }
  void hand_over() noexcept {
    // Release: the entries are filled before the reader sees that they are there.
    full_.store(true, std::memory_order_release);
    filled_.post();
  }

  // Reader: the entries that were handed over; none when there are none.
  [[nodiscard]] std::span<const Entry> front() const noexcept {
    // Acquire: pairs with hand_over().
    if (!full_.load(std::memory_order_acquire)) return {};
    return entries_;
  }
  void give_back() noexcept {
    // Release: pairs with back().
    full_.store(false, std::memory_order_release);
  }
  // Reader: sleeps until something is handed over, at most until then.
  void wait_until(Instant deadline) noexcept { static_cast<void>(filled_.wait_until(deadline)); }

 private:
  std::array<Entry, kSlotsABatch> entries_{};
  std::atomic<bool> full_{false};
  Wakeup filled_;
};

}  // namespace perimap

// The mapped features, a few at a time, and what is known of breathing and of the motion's law, from the mapper to
// whoever keeps them.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

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
    bool mapped = false;  // false: there is nothing in this slot, and `feature` means nothing
    FeatureMemory feature;
  };
  struct Batch {
    std::uint64_t maps_ended = 0;  // forgotten or moved by then: what is of a map that has ended since is void
    std::array<Entry, kSlotsABatch> entries{};
    RespirationMemory respiration;
    LawMemory law;
    SetupMemory setup;
  };

  // Mapper: the batch to fill; null while the reader has it.
  [[nodiscard]] Batch* back() noexcept {
    // Acquire: the reader's reads of the batch happen before it is filled again.
    return full_.load(std::memory_order_acquire) ? nullptr : &batch_;
  }
  void hand_over() noexcept {
    // Release: the batch is filled before the reader sees that it is there.
    full_.store(true, std::memory_order_release);
    filled_.post();
  }

  // Reader: the batch that was handed over; null when there is none.
  [[nodiscard]] const Batch* front() const noexcept {
    // Acquire: pairs with hand_over().
    return full_.load(std::memory_order_acquire) ? &batch_ : nullptr;
  }
  void give_back() noexcept {
    // Release: pairs with back().
    full_.store(false, std::memory_order_release);
  }
  // Reader: sleeps until something is handed over, at most until then.
  void wait_until(Instant deadline) noexcept { static_cast<void>(filled_.wait_until(deadline)); }

 private:
  Batch batch_;
  std::atomic<bool> full_{false};
  Wakeup filled_;
};

}  // namespace perimap

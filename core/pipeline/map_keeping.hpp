// What becomes of the map beyond one run and one patient: kept, recalled, forgotten.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/phase/heart_phase.hpp"
#include "core/pipeline/breathing.hpp"
#include "core/pipeline/feature_group.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/map_bank.hpp"
#include "core/pipeline/map_feed.hpp"
#include "core/pipeline/map_memory.hpp"
#include "core/setup_watch/setup_belief.hpp"

namespace perimap {

// All members are called by the mapper thread while the workers are at rest, but for those of feed() that are its
// reader's.
class MapKeeping {
 public:
  // Everything must outlive it; `groups` are all the slots, in order.
  MapKeeping(std::span<FeatureSlot> slots, MapBank& bank, std::span<FeatureGroup> groups) noexcept
      : slots_(slots), bank_(bank), groups_(groups) {}

  // What goes with the features.
  struct Known {
    const Breathing& breathing;
    const HeartPhase& heart;
    const SetupBelief& setup;
  };

  // Whoever keeps the mapped features, the breathing, the law and the belief in the set-up reads them here.
  [[nodiscard]] MapFeed& feed() noexcept { return feed_; }
  // Once a frame, before the workers learn from it: the next few slots, where the reader has done with the last.
  void fill_feed(const Known& known, std::uint64_t maps_ended) noexcept;

  // Before the first frame: takes the features of an earlier run, as many as there is room for and whose estimates are
  // of this layout. `breathing` is recalled. Returns the largest id taken; 0: none.
  std::uint32_t recall(std::span<const FeatureMemory> features, const Breathing& breathing) noexcept;

  // Moves every feature with what it lies on, its motion and all: a point p is where X p was. By how little it may be
  // off then, each is less certain. One whose batch start is under way is emptied when housekeeping has given it back.
  void displace(const Pose& X, double deviation_mm) noexcept;

  // Forgets every feature. One whose batch start is under way is emptied when housekeeping has given it back.
  void forget() noexcept;

 private:
  void recall(FeatureSlot& slot, const FeatureMemory& feature) noexcept;
  void remember(const FeatureSlot& slot, FeatureMemory& feature) const noexcept;

  std::span<FeatureSlot> slots_;
  MapBank& bank_;
  std::span<FeatureGroup> groups_;
  MapFeed feed_;
  std::size_t next_fed_slot_ = 0;
};

}  // namespace perimap

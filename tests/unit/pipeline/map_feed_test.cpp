#include "core/pipeline/map_feed.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <thread>

namespace perimap {
namespace {

// All that is written of a batch is its number.
void fill(MapFeed::Batch& batch, int number) {
  batch.maps_ended = static_cast<std::uint64_t>(number);
  for (MapFeed::Entry& entry : batch.entries) {
    entry.slot = static_cast<std::size_t>(number);
    entry.feature.updates = number;
    for (auto& moments : entry.feature.patch.gradient_moments) moments.fill(static_cast<std::int16_t>(number));
    entry.feature.estimate.x.setConstant(kMaxState, number);
    entry.feature.estimate.P.setConstant(kMaxState, kMaxState, number);
  }
  batch.respiration.offset_rad = number;
  batch.law.cycles = number;
}

bool is_whole(const MapFeed::Batch& batch, int number) {
  return batch.maps_ended == static_cast<std::uint64_t>(number) && batch.respiration.offset_rad == number &&
         batch.law.cycles == number && std::ranges::all_of(batch.entries, [number](const MapFeed::Entry& entry) {
           const FeatureMemory& f = entry.feature;
           return entry.slot == static_cast<std::size_t>(number) && f.updates == number &&
                  std::ranges::all_of(f.patch.gradient_moments,
                                      [number](const PatchTemplate::Pixels& moments) {
                                        return std::ranges::all_of(moments, [number](int m) { return m == number; });
                                      }) &&
                  (f.estimate.x.array() == number).all() && (f.estimate.P.array() == number).all();
         });
}

TEST(MapFeed, ABatchIsTheMappersOrTheReadersNeverBoth) {
  const auto feed = std::make_unique<MapFeed>();
  EXPECT_EQ(feed->front(), nullptr);
  ASSERT_NE(feed->back(), nullptr);
  feed->back()->maps_ended = 3;
  feed->hand_over();
  EXPECT_EQ(feed->back(), nullptr);
  ASSERT_NE(feed->front(), nullptr);
  EXPECT_EQ(feed->front()->maps_ended, 3U);
  feed->give_back();
  EXPECT_EQ(feed->front(), nullptr);
  EXPECT_NE(feed->back(), nullptr);
}

TEST(MapFeed, WhatIsHandedOverWakesTheReader) {
  const auto feed = std::make_unique<MapFeed>();
  feed->hand_over();
  const Instant deadline = MonotonicClock::now() + std::chrono::minutes(1);
  feed->wait_until(deadline);
  EXPECT_LT(MonotonicClock::now(), deadline);
}

TEST(MapFeed, EveryBatchArrivesWholeAndInOrderAcrossThreads) {
  constexpr int kBatches = 50;
  const auto feed = std::make_unique<MapFeed>();
  std::thread mapper([&feed] {
    for (int number = 1; number <= kBatches; ++number) {
      MapFeed::Batch* batch = nullptr;
      while ((batch = feed->back()) == nullptr) std::this_thread::yield();
      fill(*batch, number);
      feed->hand_over();
    }
  });
  int wrong = 0;  // no assertion in the loop: the mapper would wait for its batch for ever
  for (int number = 1; number <= kBatches; ++number) {
    const MapFeed::Batch* batch = nullptr;
    while ((batch = feed->front()) == nullptr) {
      // By turns, since what wakes the reader would also order what hand_over() itself must order.
      if (number % 2 == 0) {
        feed->wait_until(MonotonicClock::now() + std::chrono::milliseconds(1));
      } else {
        std::this_thread::yield();
      }
    }
    wrong += is_whole(*batch, number) ? 0 : 1;
    feed->give_back();
  }
  mapper.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(feed->front(), nullptr);
}

}  // namespace
}  // namespace perimap

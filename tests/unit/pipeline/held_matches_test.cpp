#include <gtest/gtest.h>

#include <cstdint>
#include <memory>

#include "core/pipeline/feature_slot.hpp"

namespace perimap {
namespace {

constexpr std::uint64_t kRoom = 256;

struct Held : ::testing::Test {
  std::unique_ptr<HeldMatches> held = std::make_unique<HeldMatches>();

  void push(std::uint64_t first, std::uint64_t end) {
    for (std::uint64_t frame = first; frame < end; ++frame) held->push({.frame_index = frame});
  }
  // The frames from `first` on, one after the other.
  void expect_from(std::uint64_t first, std::uint64_t end) const {
    ASSERT_EQ(held->size(), end - first);
    for (std::uint32_t i = 0; i < held->size(); ++i) EXPECT_EQ((*held)[i].frame_index, first + i);
  }
};

TEST_F(Held, WhatWasDroppedIsTakenBackInItsOrder) {
  push(0, 20);
  held->drop(15);
  held->take_back();
  expect_from(0, 20);
}

TEST_F(Held, WhatWasDroppedIsTakenBackWhenNothingIsLeft) {
  push(0, 20);
  held->drop(20);
  held->take_back();
  expect_from(0, 20);
}

TEST_F(Held, AsMuchIsTakenBackAsThereIsRoomFor) {
  push(0, 1000);
  held->drop(200);
  held->take_back();
  expect_from(1000 - kRoom, 1000);
}

TEST_F(Held, WhatWasHeldBeforeAllWasClearedIsNotTakenBack) {
  push(0, 20);
  held->clear();
  push(30, 35);
  held->drop(5);
  held->take_back();
  expect_from(30, 35);
}

TEST_F(Held, WhatLostItsPlaceToOthersIsNotTakenForOlder) {
  push(0, kRoom + 10);
  held->drop_if([](const HeldMatch& match) { return match.frame_index < kRoom; });
  expect_from(kRoom, kRoom + 10);
  held->take_back();
  for (std::uint32_t i = 1; i < held->size(); ++i) {
    EXPECT_LT((*held)[i - 1].frame_index, (*held)[i].frame_index);
  }
  EXPECT_EQ((*held)[held->size() - 1].frame_index, kRoom + 9);
}

}  // namespace
}  // namespace perimap

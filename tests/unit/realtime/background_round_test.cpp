#include "core/realtime/background_round.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace perimap {
namespace {

// Doubles what it is given, on a thread of its own, when it may.
struct Doubling {
  explicit Doubling(bool awaited) : round(awaited), thread([this] { serve(); }) {}
  ~Doubling() {
    may.post();
    round.dismiss();
    thread.join();
  }
  void serve() {
    round.serve([this] {
      may.wait();
      result = 2 * asked;
    });
  }

  BackgroundRound round;
  Wakeup may;
  int asked = 0;
  int result = 0;
  std::thread thread;
};

TEST(BackgroundRound, WhatIsAwaitedIsDoneWhenItIsTakenBack) {
  Doubling doubling(true);
  for (int i = 1; i <= 1000; ++i) {
    doubling.asked = i;
    doubling.may.post();
    doubling.round.begin();
    EXPECT_TRUE(doubling.round.under_way());
    ASSERT_TRUE(doubling.round.finish());
    EXPECT_EQ(doubling.result, 2 * i);
    EXPECT_FALSE(doubling.round.under_way());
  }
}

TEST(BackgroundRound, WhatIsNotAwaitedStaysUnderWayUntilItIsDone) {
  Doubling doubling(false);
  for (int i = 1; i <= 100; ++i) {
    doubling.asked = i;
    doubling.round.begin();
    EXPECT_FALSE(doubling.round.finish());
    EXPECT_TRUE(doubling.round.under_way());
    doubling.may.post();
    while (!doubling.round.finish()) std::this_thread::yield();
    EXPECT_EQ(doubling.result, 2 * i);
    EXPECT_FALSE(doubling.round.under_way());
  }
}

TEST(BackgroundRound, NothingIsDoneThatWasNotAsked) {
  Doubling doubling(true);
  EXPECT_FALSE(doubling.round.finish()) << "nor waited for";
}

}  // namespace
}  // namespace perimap

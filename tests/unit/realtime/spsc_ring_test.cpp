#include "core/realtime/spsc_ring.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace perimap {
namespace {

TEST(SpscRing, PushFailsWhenFullAndIsCounted) {
  SpscRing<int> ring(2);
  EXPECT_TRUE(ring.push(1));
  EXPECT_TRUE(ring.push(2));
  EXPECT_FALSE(ring.push(3));
  EXPECT_EQ(ring.refused(), 1U);
  int value = 0;
  EXPECT_TRUE(ring.pop(value));
  EXPECT_EQ(value, 1);
}

TEST(SpscRing, PopFailsWhenEmpty) {
  SpscRing<int> ring(2);
  int value = 42;
  EXPECT_FALSE(ring.pop(value));
  EXPECT_EQ(value, 42);
}

TEST(SpscRing, KeepsEveryValueInOrderAcrossThreads) {
  constexpr int kCount = 200'000;
  SpscRing<int> ring(64);
  std::thread producer([&ring] {
    for (int i = 0; i < kCount; ++i) {
      while (!ring.push(i)) std::this_thread::yield();
    }
  });
  for (int expected = 0; expected < kCount;) {
    int value = -1;
    if (!ring.pop(value)) {
      std::this_thread::yield();
      continue;
    }
    ASSERT_EQ(value, expected);
    ++expected;
  }
  producer.join();
}

}  // namespace
}  // namespace perimap

#include "core/pipeline/frame_pool.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <thread>

namespace perimap {
namespace {

constexpr int kBuffers = 8;

std::span<std::uint8_t> grey_of(FramePool& pool, int buffer) {
  return {pool.pixels(buffer), static_cast<std::size_t>(pool.width()) * static_cast<std::size_t>(pool.height())};
}

std::span<std::uint8_t> bgr_of(FramePool& pool, int buffer) {
  const ColourImage colour = pool.colour(buffer);
  return {pool.bgr(buffer), static_cast<std::size_t>(colour.stride) * static_cast<std::size_t>(colour.height)};
}

// Every buffer once, then none.
void expect_all_free(FramePool& pool) {
  std::set<int> taken;
  for (int i = 0; i < kBuffers; ++i) taken.insert(pool.acquire(kBuffers));
  EXPECT_EQ(taken, (std::set<int>{0, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(pool.acquire(kBuffers), -1);
}

TEST(FramePool, GivesEachBufferOnceUntilItIsGivenBack) {
  FramePool pool(16, 12, kBuffers);
  expect_all_free(pool);
  pool.give_back(2);
  EXPECT_EQ(pool.acquire(kBuffers), 2);
  EXPECT_EQ(pool.acquire(kBuffers), -1);
}

TEST(FramePool, BuffersDoNotOverlap) {
  FramePool pool(15, 11, kBuffers);
  for (int b = 0; b < kBuffers; ++b) {
    std::ranges::fill(grey_of(pool, b), static_cast<std::uint8_t>(1 + b));
    std::ranges::fill(bgr_of(pool, b), static_cast<std::uint8_t>(101 + b));
  }
  for (int b = 0; b < kBuffers; ++b) {
    EXPECT_EQ(std::ranges::count(grey_of(pool, b), 1 + b), 15 * 11) << b;
    EXPECT_EQ(std::ranges::count(bgr_of(pool, b), 101 + b), std::ssize(bgr_of(pool, b))) << b;
  }
}

// Each frame is filled with its number: one that is filled anew while it is read, or read before it is filled, has
// another somewhere.
TEST(FramePool, NoBufferIsFilledWhileItIsRead) {
  constexpr std::uint64_t kFrames = 1000;
  const auto value_of = [](std::uint64_t sequence) { return static_cast<std::uint8_t>(sequence % 251); };
  FramePool pool(16, 12, kBuffers);
  // One place less than buffers: now the camera finds no free buffer, now it cannot hand on the one it has filled.
  SpscRing<FrameHandle> frames(kBuffers - 1);
  std::thread camera([&] {
    for (std::uint64_t sequence = 0; sequence < kFrames;) {
      FrameHandle frame;
      while ((frame.buffer = pool.acquire(kBuffers)) < 0) std::this_thread::yield();
      frame.stamp.sequence = sequence;
      std::ranges::fill(grey_of(pool, frame.buffer), value_of(sequence));
      std::ranges::fill(bgr_of(pool, frame.buffer), value_of(sequence));
      if (frames.push(frame)) {
        ++sequence;
      } else {
        pool.give_back(frame.buffer);
        std::this_thread::yield();
      }
    }
  });
  int wrong = 0;  // no assertion in the loop: the camera would wait for a buffer for ever
  for (std::uint64_t sequence = 0; sequence < kFrames; ++sequence) {
    FrameHandle frame;
    while (!frames.pop(frame)) std::this_thread::yield();
    const auto is_its_own = [&](std::uint8_t value) { return value == value_of(sequence); };
    const bool whole = frame.stamp.sequence == sequence &&
                       std::ranges::all_of(grey_of(pool, frame.buffer), is_its_own) &&
                       std::ranges::all_of(bgr_of(pool, frame.buffer), is_its_own);
    wrong += whole ? 0 : 1;
    pool.give_back(frame.buffer);
  }
  camera.join();
  EXPECT_EQ(wrong, 0);
  expect_all_free(pool);
}

}  // namespace
}  // namespace perimap

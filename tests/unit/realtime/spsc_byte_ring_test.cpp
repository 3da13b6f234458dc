#include "core/realtime/spsc_byte_ring.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <thread>
#include <vector>

#include "core/realtime/spsc_ring.hpp"

namespace perimap {
namespace {

// Byte k of a stream that does not repeat itself within any of these tests' rings.
std::byte stream_byte(std::uint32_t k) { return static_cast<std::byte>((k * 2'654'435'761U) >> 24U); }

TEST(SpscByteRing, TakesAllOfTheBytesOrNone) {
  const std::vector<std::byte> five(5, std::byte{5});
  const std::vector<std::byte> four(4, std::byte{4});
  SpscByteRing ring(8);
  ASSERT_TRUE(ring.push(five));
  EXPECT_FALSE(ring.push(four));
  std::vector<std::byte> popped(5);
  ring.pop(popped);
  EXPECT_EQ(popped, five);
  // Around the end.
  ASSERT_TRUE(ring.push(four));
  ASSERT_TRUE(ring.push(four));
  EXPECT_FALSE(ring.push(std::span(four).first(1)));
  popped.resize(8);
  ring.pop(popped);
  EXPECT_EQ(popped, std::vector<std::byte>(8, std::byte{4}));
}

TEST(SpscByteRing, KeepsEveryByteInOrderAcrossThreads) {
  constexpr std::uint32_t kRuns = 2000;
  constexpr std::uint32_t kLongest = 97;
  SpscByteRing ring(2039);  // fills up before the lengths do, and no run ends where it does
  SpscRing<std::uint32_t> lengths(64);
  std::thread producer([&] {
    std::array<std::byte, kLongest> run{};
    std::uint32_t k = 0;
    for (std::uint32_t i = 0; i < kRuns; ++i) {
      const std::uint32_t length = 1 + i % kLongest;
      for (std::uint32_t j = 0; j < length; ++j) run[j] = stream_byte(k++);
      while (!ring.push(std::span(run).first(length))) std::this_thread::yield();
      while (!lengths.push(length)) std::this_thread::yield();
    }
  });
  std::array<std::byte, kLongest> run{};
  std::uint32_t k = 0;
  std::uint32_t wrong = 0;  // no assertion in the loop: the producer would wait for room for ever
  for (std::uint32_t i = 0; i < kRuns; ++i) {
    std::uint32_t length = 0;
    while (!lengths.pop(length)) std::this_thread::yield();
    run.fill(std::byte{});
    ring.pop(std::span(run).first(length / 2));
    ring.pop(std::span(run).subspan(length / 2, length - length / 2));
    for (std::uint32_t j = 0; j < length; ++j) wrong += run[j] == stream_byte(k++) ? 0U : 1U;
  }
  producer.join();
  EXPECT_EQ(wrong, 0U);
}

}  // namespace
}  // namespace perimap

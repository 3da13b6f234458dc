#include "core/realtime/latency_histogram.hpp"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>

namespace perimap {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

TEST(LatencyHistogram, EmptyIsAllZero) {
  const auto s = LatencyHistogram().summary();
  EXPECT_EQ(s.count, 0U);
  EXPECT_EQ(s.p50, Duration(0));
  EXPECT_EQ(s.max, Duration(0));
}

TEST(LatencyHistogram, QuantilesAreWithinOneSixteenthAndTheMaximumIsExact) {
  LatencyHistogram h;
  for (int i = 1; i <= 1000; ++i) h.add(microseconds(i));
  h.add(milliseconds(77));
  const auto s = h.summary();
  EXPECT_EQ(s.count, 1001U);
  EXPECT_NEAR(static_cast<double>(s.p50.count()), 501e3, 501e3 / 16);
  EXPECT_NEAR(static_cast<double>(s.p99.count()), 991e3, 991e3 / 16);
  EXPECT_NEAR(static_cast<double>(s.p999.count()), 1000e3, 1000e3 / 16);
  EXPECT_EQ(s.max, milliseconds(77));
}

TEST(LatencyHistogram, WhatCameBetweenTwoMomentsIsSummedUpByItself) {
  LatencyHistogram h;
  for (int i = 0; i < 1000; ++i) h.add(milliseconds(50));
  const auto before = h.counts();
  for (int i = 0; i < 99; ++i) h.add(microseconds(10));
  h.add(microseconds(300));
  const auto s = LatencyHistogram::between(before, h.counts());
  EXPECT_EQ(s.count, 100U);
  EXPECT_NEAR(static_cast<double>(s.p99.count()), 10e3, 10e3 / 16);
  EXPECT_NEAR(static_cast<double>(s.p999.count()), 300e3, 300e3 / 16);
  EXPECT_NEAR(static_cast<double>(s.max.count()), 300e3, 300e3 / 16);
  EXPECT_EQ(LatencyHistogram::between(before, before).count, 0U);
}

TEST(LatencyHistogram, HoldsTheExtremes) {
  LatencyHistogram h;
  h.add(nanoseconds(-5));
  h.add(nanoseconds(0));
  h.add(std::chrono::hours(10));
  const auto s = h.summary();
  EXPECT_EQ(s.count, 3U);
  EXPECT_EQ(s.p50, Duration(0));
  EXPECT_EQ(s.max, std::chrono::hours(10));
}

// Looks until the writer has done, and once more. Counts and maximum only rise, and never beyond what will be there.
void watch(const LatencyHistogram& histogram, const LatencyHistogram& whole, const std::atomic<bool>& done) {
  const LatencyHistogram::Counts all = whole.counts();
  LatencyHistogram::Counts before{};
  Duration max{0};
  std::uint64_t came = 0;
  for (bool last = false; !last;) {
    last = done.load(std::memory_order_acquire);
    const LatencyHistogram::Counts counts = histogram.counts();
    for (std::size_t i = 0; i < counts.size(); ++i) {
      ASSERT_GE(counts[i], before[i]) << i;
      ASSERT_LE(counts[i], all[i]) << i;
    }
    came += LatencyHistogram::between(before, counts).count;
    before = counts;
    const LatencyHistogram::Summary summary = histogram.summary();
    ASSERT_GE(summary.max, max);
    max = summary.max;
    std::this_thread::yield();
  }
  EXPECT_EQ(before, all);
  EXPECT_EQ(came, whole.summary().count);
  EXPECT_EQ(max, whole.summary().max);
}

TEST(LatencyHistogram, ReadersLoseNothingOfWhatIsAddedMeanwhile) {
  constexpr int kDurations = 20'000;
  // Each bucket again and again, and a maximum that rises throughout.
  const auto duration = [](int i) { return microseconds(i % 7 == 0 ? i : i % 1000); };
  LatencyHistogram whole;
  for (int i = 0; i < kDurations; ++i) whole.add(duration(i));
  LatencyHistogram histogram;
  std::atomic<bool> done{false};
  std::array<std::thread, 2> readers;
  for (std::thread& reader : readers) reader = std::thread([&] { watch(histogram, whole, done); });
  for (int i = 0; i < kDurations; ++i) {
    histogram.add(duration(i));
    if (i % 512 == 0) std::this_thread::yield();
  }
  done.store(true, std::memory_order_release);
  for (std::thread& reader : readers) reader.join();
}

}  // namespace
}  // namespace perimap

#include "core/realtime/latency_histogram.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace perimap

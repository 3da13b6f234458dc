#include "drivers/device/rate_check.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

const Instant kStart(seconds(100));

// A device that counts at a rate, each count late by what the function says.
template <typename Late>
void run(RateCheck& check, double rate_hz, Duration from, Duration to, const Late& late) {
  const auto last = static_cast<std::int64_t>(to_seconds(to) * rate_hz);
  for (auto count = static_cast<std::int64_t>(std::ceil(to_seconds(from) * rate_hz)); count < last; ++count) {
    const Duration since = from_seconds(static_cast<double>(count) / rate_hz);
    check.observe(count, kStart + since + late(since));
  }
}

Duration punctual(Duration /*since*/) { return Duration(0); }

TEST(RateCheck, ARateThatIsNotTheNominalOneIsNoticedWithinSevenSeconds) {
  for (const double seen_hz : {20.0, 30.0, 55.0, 66.0, 120.0}) {
    RateCheck check(60.0);
    run(check, seen_hz, seconds(0), seconds(5), punctual);
    EXPECT_FALSE(check.wrong()) << "one measurement is none";
    run(check, seen_hz, seconds(5), seconds(7), punctual);
    EXPECT_TRUE(check.wrong()) << seen_hz;
    EXPECT_NEAR(check.seen_hz(), seen_hz, 0.02 * seen_hz);
  }
}

TEST(RateCheck, ADriftOfTheDevicesClockAndLateArrivalsAreNoWrongRate) {
  RateCheck check(60.0);
  // Half a percent fast, a stop of the machine of 0.4 s every 2 s, and what came meanwhile at its end.
  const auto late = [](Duration since) {
    const Duration into = since % seconds(2);
    return into < milliseconds(400) ? milliseconds(400) - into : Duration(0);
  };
  run(check, 60.3, seconds(0), seconds(60), late);
  EXPECT_FALSE(check.wrong());
}

TEST(RateCheck, WhatIsLeftOutAndWhatComesAgainDoesNotCount) {
  RateCheck check(60.0);
  for (int i = 0; i < 600; ++i) {
    if (i % 7 == 0) continue;
    for (int times = 0; times < 2; ++times) check.observe(i, kStart + i * std::chrono::microseconds(16667));
  }
  EXPECT_FALSE(check.wrong());
  EXPECT_NEAR(check.seen_hz(), 60.0, 0.1);
}

TEST(RateCheck, AGapOrANewCountIsNotMeasuredAndTheVerdictStaysUntilTheRateIsRight) {
  RateCheck check(60.0);
  run(check, 30.0, seconds(0), seconds(7), punctual);
  ASSERT_TRUE(check.wrong());
  check.restart();
  run(check, 60.0, seconds(10), seconds(12), punctual);
  EXPECT_TRUE(check.wrong());
  run(check, 60.0, seconds(12), seconds(14), punctual);
  EXPECT_FALSE(check.wrong());
  // The same second of counts, each time after two seconds of nothing.
  for (int i = 0; i < 10; ++i) {
    const Instant begin = kStart + seconds(20 + 3 * i);
    for (int count = 0; count < 60; ++count) check.observe(60 * i + count, begin + count * milliseconds(16));
  }
  EXPECT_FALSE(check.wrong());
}

}  // namespace
}  // namespace perimap

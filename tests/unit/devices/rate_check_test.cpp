#include "drivers/device/rate_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "drivers/device/arrival_clock.hpp"

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

TEST(RateCheck, ARateThatIsNotTheNominalOneIsNoticedTheSoonerTheMoreItIsOff) {
  struct Case {
    double seen_hz;
    Duration not_yet;
    Duration noticed;
  };
  for (const Case& c :
       {Case{20.0, milliseconds(500), milliseconds(1100)}, Case{30.0, milliseconds(500), milliseconds(1100)},
        Case{120.0, milliseconds(500), milliseconds(1100)}, Case{55.0, milliseconds(1200), milliseconds(2700)},
        Case{66.0, milliseconds(1200), milliseconds(2700)}}) {
    RateCheck check(60.0);
    run(check, c.seen_hz, seconds(0), c.not_yet, punctual);
    EXPECT_FALSE(check.wrong()) << "one measurement is none: " << c.seen_hz;
    run(check, c.seen_hz, c.not_yet, c.noticed, punctual);
    EXPECT_TRUE(check.wrong()) << c.seen_hz;
    EXPECT_NEAR(check.seen_hz(), c.seen_hz, 0.02 * c.seen_hz);
  }
}

TEST(RateCheck, ADeviceThatChangesItsRateIsNoticedAsSoon) {
  RateCheck check(60.0);
  run(check, 60.0, seconds(0), seconds(30), punctual);
  ASSERT_FALSE(check.wrong());
  for (int i = 0; i < 33; ++i) check.observe(1800 + i, kStart + seconds(30) + i * milliseconds(33));
  EXPECT_TRUE(check.wrong());
}

// The bound that docs/guide/devices.md states: of a device that counts up to four times too slowly or too fast, from
// the start or from some moment on.
TEST(RateCheck, UntilItIsNoticedAStampIsWrongByTwoThirdsOfASecondAtMost) {
  constexpr double kNominal_hz = 60.0;
  for (const bool from_the_start : {true, false}) {
    for (double seen_hz = 15.0; seen_hz < 240.0; seen_hz *= 1.04) {
      if (std::abs(seen_hz / kNominal_hz - 1.0) < 0.06) continue;
      RateCheck check(kNominal_hz);
      ArrivalClock clock({.period_ns = 1e9 / kNominal_hz});
      Instant t = kStart;
      double most_s = 0.0;
      Duration unnoticed{0};
      for (std::int64_t count = 0; !check.wrong() && unnoticed < seconds(60); ++count) {
        const bool nominal = !from_the_start && count < 600;
        clock.observe(count, t);
        check.observe(count, t);
        if (!check.wrong()) most_s = std::max(most_s, std::abs(to_seconds(t - clock.stamp(count))));
        const Duration step = from_seconds(1.0 / (nominal ? kNominal_hz : seen_hz));
        t += step;
        if (!nominal) unnoticed += step;
      }
      EXPECT_LE(unnoticed, milliseconds(2700)) << seen_hz;
      EXPECT_LE(most_s, 2.0 / 3.0) << seen_hz << (from_the_start ? " from the start" : " later");
    }
  }
}

TEST(RateCheck, ACountThatJumpsIsNoWrongRate) {
  RateCheck check(60.0);
  for (int i = 0; i < 1200; ++i) {
    check.observe(i + 30 * (i / 200), kStart + i * std::chrono::microseconds(16667));
    ASSERT_FALSE(check.wrong()) << i;
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
  run(check, 60.0, seconds(10), milliseconds(10900), punctual);
  EXPECT_TRUE(check.wrong());
  run(check, 60.0, milliseconds(10900), seconds(14), punctual);
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

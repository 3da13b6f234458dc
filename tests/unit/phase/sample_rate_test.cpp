#include "core/phase/sample_rate.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace perimap {
namespace {

Instant at(double t_s) { return Instant(from_seconds(t_s)); }

TEST(SampleRate, IsKnownAfterSixteenStepsWithoutInterruption) {
  SampleRate rate;
  for (int i = 0; i < 16; ++i) rate.push(at(0.004 * i));
  EXPECT_EQ(rate.period(), Duration::zero());
  rate.interrupt();
  for (int i = 0; i < 16; ++i) rate.push(at(7.0 + 0.004 * i));
  EXPECT_EQ(rate.period(), Duration::zero());
  rate.push(at(7.0 + 0.004 * 16));
  EXPECT_NEAR(to_seconds(rate.period()), 0.004, 1e-9);
}

TEST(SampleRate, IsThatOfStampsRoundedToMilliseconds) {
  for (const double hz : {360.0, 512.0, 720.0, 900.0}) {
    SampleRate rate;
    for (int i = 0; i < 400; ++i) rate.push(at(1e-3 * std::round(1e3 * i / hz)));
    EXPECT_NEAR(to_seconds(rate.period()) * hz, 1.0, 0.03) << hz;
    EXPECT_FALSE(rate.contradicts(Duration(from_seconds(1.0 / hz)))) << hz;
  }
}

TEST(SampleRate, SamplesThatAreMissingDoNotTell) {
  SampleRate rate;
  int stamp = 0;
  for (int i = 0; i < 400; ++i) {
    stamp += i % 37 == 5 ? 6 : 1;
    rate.push(at(0.002 * stamp));
  }
  EXPECT_NEAR(to_seconds(rate.period()), 0.002, 1e-9);
}

TEST(SampleRate, AnotherRateIsKnownAfterFiveTimesSixteenSteps) {
  SampleRate rate;
  const Duration was = std::chrono::milliseconds(2);
  double t_s = 0.0;
  for (int i = 0; i < 400; ++i) rate.push(at(t_s += 0.002));
  EXPECT_FALSE(rate.contradicts(was));
  int steps = 0;
  while (!rate.contradicts(was) && steps < 1000) {
    rate.push(at(t_s += 0.010));
    ++steps;
  }
  EXPECT_LE(steps, 6 * 16);
  EXPECT_NEAR(to_seconds(rate.period()), 0.010, 1e-9);
}

TEST(SampleRate, AFewStepsContradictNothing) {
  SampleRate rate;
  for (int i = 0; i < 60; ++i) rate.push(at(0.0005 * i));
  EXPECT_FALSE(rate.contradicts(std::chrono::milliseconds(2)));
}

}  // namespace
}  // namespace perimap

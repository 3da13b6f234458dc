#include "core/phase/ecg_levels.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "core/phase/ecg_filter.hpp"

namespace perimap {
namespace {

constexpr double kRate_hz = 250.0;

// One complex of that height each 0.8 s.
double beats_mV(double t_s, double height) {
  const double x = std::remainder(t_s - 0.4, 0.8) / 0.012;
  return height * std::exp(-0.5 * x * x);
}

struct EcgLevelsTest : testing::Test {
  EcgLevelSettings settings;
  EcgLevels levels{settings};
  EcgFilter filter;
  std::mt19937_64 generator{0x27c5a9e14f08b36dU};
  std::normal_distribution<double> noise{0.0, 1.0};
  double t_s = 0.0;
  double beat_slope = 0.0;
  bool burst = false;

  EcgLevelsTest() { filter.restart(from_seconds(1.0 / kRate_hz)); }
  void hear(double length_s, const std::function<double(double)>& value_mV) {
    for (const double until = t_s + length_s; t_s < until; t_s += 1.0 / kRate_hz) {
      filter.push(Instant(from_seconds(t_s)), value_mV(t_s), false);
      levels.follow(filter, beat_slope, burst);
    }
  }
};

TEST_F(EcgLevelsTest, TheQuietLevelIsOfTheLineBetweenBeats) {
  hear(6.0, [&](double t) { return beats_mV(t, 1.0) + 0.01 * noise(generator); });
  const double with_beats = levels.quiet();
  EXPECT_LT(with_beats, 0.05 * levels.top_energy());
  EXPECT_GT(with_beats, 0.0);
}

TEST_F(EcgLevelsTest, NoiseIsWhatIsAlwaysThereAndNotInABurst) {
  const auto line = [&](double t, double noise_mV) { return beats_mV(t, 1.0) + noise_mV * noise(generator); };
  hear(15.0, [&](double t) { return line(t, 0.02); });
  const double before = levels.noise();
  hear(15.0, [&](double t) { return line(t, 0.4); });
  EXPECT_GT(levels.quiet(), 8.0 * before);
  EXPECT_LT(levels.noise(), 2.0 * before) << "a burst";
  hear(1000.0, [&](double t) { return line(t, 0.05); });
  EXPECT_GT(levels.noise(), 0.5 * levels.quiet()) << "it has come to stay";
  hear(4.0, [&](double t) { return line(t, 0.02); });
  EXPECT_LT(levels.noise(), 2.0 * before) << "it has gone";
}

TEST_F(EcgLevelsTest, NoiseThatWasThereFromTheFirstIsKnownAtOnce) {
  hear(1.0, [&](double t) { return beats_mV(t, 1.0) + 0.2 * noise(generator); });
  const double early = levels.noise();
  hear(20.0, [&](double t) { return beats_mV(t, 1.0) + 0.2 * noise(generator); });
  EXPECT_NEAR(early, levels.noise(), 0.4 * levels.noise());
}

TEST_F(EcgLevelsTest, TheTopIsOfTheLargestComplexesAndOneThatIsLargerIsNoMeasure) {
  hear(15.0, [&](double t) { return beats_mV(t, 1.0); });
  const double usual = levels.top_energy();
  hear(1.6, [&](double t) { return beats_mV(t, 6.0); });
  EXPECT_NEAR(levels.top_energy(), usual, 0.02 * usual);
}

TEST_F(EcgLevelsTest, TheTopStandsStillInABurst) {
  hear(15.0, [&](double t) { return beats_mV(t, 1.0); });
  const double usual = levels.top_energy();
  burst = true;
  hear(20.0, [&](double t) { return beats_mV(t, 8.0); });
  EXPECT_NEAR(levels.top_energy(), usual, 0.02 * usual);
}

TEST_F(EcgLevelsTest, OfATopThatIsForgottenTheLastWindowStays) {
  hear(15.0, [&](double t) { return beats_mV(t, 1.0); });
  const double before = levels.top_energy();
  hear(3.2, [&](double t) { return beats_mV(t, 0.1); });
  levels.forget_top(false);
  EXPECT_NEAR(levels.top_energy(), 0.1 * before, 0.02 * before);
}

TEST_F(EcgLevelsTest, TheTopOfTheBeatsIsRecalledWhenTheyComeAsBefore) {
  hear(15.0, [&](double t) { return beats_mV(t, 1.0); });
  const double before = levels.top_energy();
  levels.forget_top(true);
  hear(20.0, [&](double t) { return beats_mV(t, 0.1); });
  levels.forget_top(false);  // what came in between were none
  hear(20.0, [&](double t) { return beats_mV(t, 0.1); });
  EXPECT_NEAR(levels.top_energy(), 0.1 * before, 0.02 * before);
  levels.recall_top();
  hear(0.8, [&](double t) { return beats_mV(t, 1.0); });
  EXPECT_NEAR(levels.top_energy(), before, 0.02 * before);
}

TEST_F(EcgLevelsTest, ATopIsRecalledOnce) {
  hear(15.0, [&](double t) { return beats_mV(t, 1.0); });
  const double before = levels.top_energy();
  levels.forget_top(true);
  levels.recall_top();
  hear(15.0, [&](double t) { return beats_mV(t, 0.1); });
  levels.recall_top();
  EXPECT_NEAR(levels.top_energy(), 0.1 * before, 0.02 * before);
}

TEST_F(EcgLevelsTest, ALineAsRoughAsTheBeatsAreSteepShowsNothing) {
  hear(5.0, [&](double t) { return beats_mV(t, 1.0) + 0.01 * noise(generator); });
  beat_slope = 0.8;
  hear(5.0, [&](double t) { return beats_mV(t, 1.0) + 0.01 * noise(generator); });
  EXPECT_FALSE(levels.rough(Instant(from_seconds(t_s - 0.1))));
  const double begin_s = t_s;
  hear(2.0, [&](double) { return 3.0 * noise(generator); });
  EXPECT_TRUE(levels.rough(Instant(from_seconds(begin_s + 0.5))));
  EXPECT_TRUE(levels.rough(Instant(from_seconds(begin_s + 1.9))));
  hear(2.0, [&](double t) { return beats_mV(t, 1.0) + 0.01 * noise(generator); });
  EXPECT_FALSE(levels.rough(Instant(from_seconds(t_s - 0.5))));
}

TEST_F(EcgLevelsTest, HumThatComesToStayBecomesTheUsual) {
  beat_slope = 0.8;
  hear(5.0, [&](double t) { return beats_mV(t, 1.0) + 0.01 * noise(generator); });
  hear(5.0, [&](double) { return 2.0 * noise(generator); });
  EXPECT_TRUE(levels.rough(Instant(from_seconds(t_s - 0.1))));
  hear(400.0, [&](double) { return 2.0 * noise(generator); });
  EXPECT_FALSE(levels.rough(Instant(from_seconds(t_s - 0.1))));
}

// ---- the quiet level: of a line that rises evenly the energy is the rise in 20 ms

TEST_F(EcgLevelsTest, TheQuietLevelIsALowQuantileOfTheLastTwoAndAHalfSeconds) {
  double at_mV = 0.0;
  const auto rise = [&](double length_s, double mV_per_s) {
    hear(length_s, [&](double) { return at_mV += mV_per_s / kRate_hz; });
  };
  rise(6.0, 0.5);
  EXPECT_NEAR(levels.quiet(), 0.01, 1e-6);
  rise(1.70, 5.0);
  EXPECT_NEAR(levels.quiet(), 0.01, 1e-3);
  rise(0.25, 5.0);
  EXPECT_GT(levels.quiet(), 0.05);
}

TEST_F(EcgLevelsTest, TheQuietLevelIsFormedTenTimesASecond) {
  hear(5.0, [&](double) { return noise(generator); });
  int formed = 0;
  for (int i = 0; i < 1000; ++i) {
    const double before = levels.quiet();
    hear(0.5 / kRate_hz, [&](double) { return noise(generator); });
    formed += levels.quiet() != before ? 1 : 0;
  }
  EXPECT_LE(formed, 33);
  EXPECT_GE(formed, 24) << "now and then it comes out as before";
}

// ---- the largest complexes: the upper median of eight windows of 1.5 s

TEST_F(EcgLevelsTest, TheTopFollowsSmallerBeatsWhenThreeWindowsHoldNoOthers) {
  hear(15.0, [&](double t) { return beats_mV(t, 1.0); });
  const double usual = levels.top_energy();
  hear(4.4, [&](double t) { return beats_mV(t, 0.1); });
  EXPECT_NEAR(levels.top_energy(), usual, 0.02 * usual);
  hear(1.2, [&](double t) { return beats_mV(t, 0.1); });
  EXPECT_NEAR(levels.top_energy(), 0.1 * usual, 0.01 * usual);
}

TEST_F(EcgLevelsTest, TheTopFollowsLargerBeatsWhenMostWindowsHoldThem) {
  hear(15.0, [&](double t) { return beats_mV(t, 1.0); });
  const double usual = levels.top_energy();
  hear(4.4, [&](double t) { return beats_mV(t, 3.0); });
  EXPECT_NEAR(levels.top_energy(), usual, 0.02 * usual);
  hear(3.2, [&](double t) { return beats_mV(t, 3.0); });
  EXPECT_NEAR(levels.top_energy(), 3.0 * usual, 0.1 * usual);
}

TEST_F(EcgLevelsTest, WhileTwoWindowsAreKnownTheLargestOfAllCounts) {
  hear(3.1, [&](double t) { return beats_mV(t, 1.0); });
  const double usual = levels.top_energy();
  hear(0.8, [&](double t) { return beats_mV(t, 6.0); });
  EXPECT_GT(levels.top_energy(), 5.0 * usual);
}

TEST_F(EcgLevelsTest, OnceThreeWindowsAreKnownOneLargeComplexIsNoMeasure) {
  hear(4.7, [&](double t) { return beats_mV(t, 1.0); });
  const double usual = levels.top_energy();
  hear(0.9, [&](double t) { return beats_mV(t, 6.0); });
  EXPECT_NEAR(levels.top_energy(), usual, 0.02 * usual);
}

// ---- roughness: a line that goes up and down with every sample is evenly rough

struct RoughLine : EcgLevelsTest {
  // How rough a line is that alternates by 1 mV.
  double unit = 0.0;
  double sign = 1.0;

  RoughLine() {
    EcgFilter alone;
    alone.restart(from_seconds(1.0 / kRate_hz));
    for (int i = 0; i < 200; ++i) alone.push(Instant(from_seconds(i / kRate_hz)), i % 2 == 0 ? 1.0 : -1.0, false);
    unit = alone.at(alone.now()).rough;
  }
  void hear_rough(double length_s, double rough) {
    hear(length_s, [&](double) { return (sign = -sign) * rough / unit; });
  }
  [[nodiscard]] bool rough_now() const {
    return t_s - 1.0 / kRate_hz < to_seconds(levels.rough_until().time_since_epoch()) - 0.149;
  }
};

TEST_F(RoughLine, SeveralTimesTheUsualIsRough) {
  beat_slope = 1e-6;
  hear_rough(3.0, 0.01);
  hear_rough(1.0, 0.033);
  EXPECT_FALSE(rough_now());
  hear_rough(1.0, 0.048);
  EXPECT_TRUE(rough_now());
}

TEST_F(RoughLine, WhereTheLineBeginsItIsNotTakenForSmooth) {
  beat_slope = 1e-6;
  hear_rough(3.0, 0.01);
  filter.restart(from_seconds(1.0 / kRate_hz));
  levels.restart();
  hear_rough(3.0, 0.03);
  EXPECT_FALSE(rough_now());
}

TEST_F(RoughLine, WhatIsSmallBesideTheBeatsIsNot) {
  beat_slope = 1.0;
  hear_rough(3.0, 0.001);
  hear_rough(1.0, 0.43);
  EXPECT_FALSE(rough_now());
  hear_rough(1.0, 0.57);
  EXPECT_TRUE(rough_now());
}

TEST_F(RoughLine, ABurstThatFluctuatesIsOne) {
  beat_slope = 1.0;
  hear_rough(3.0, 0.001);
  hear_rough(1.0, 1.0);
  hear_rough(1.0, 0.28);
  EXPECT_TRUE(rough_now()) << "half of the limit is a quarter of the beats' slope";
  hear_rough(1.0, 0.21);
  EXPECT_FALSE(rough_now());
}

TEST_F(RoughLine, HumBecomesTheUsualAfterMoreThanABurstLasts) {
  beat_slope = 1e-6;
  hear_rough(3.0, 0.01);
  hear_rough(36.0, 0.08);
  EXPECT_TRUE(rough_now());
  hear_rough(12.0, 0.08);
  EXPECT_FALSE(rough_now());
}

// The mean over 80 ms is rough for 80 ms longer than the line.
TEST_F(RoughLine, AQrsComplexIsNotRoughForLongEnough) {
  beat_slope = 1.0;
  hear_rough(3.0, 0.001);
  hear_rough(0.1, 100.0);
  hear_rough(1.0, 0.001);
  EXPECT_EQ(levels.rough_until(), Instant());
  hear_rough(0.15, 100.0);
  hear_rough(1.0, 0.001);
  EXPECT_GT(levels.rough_until(), Instant());
}

TEST_F(RoughLine, ABurstBeginsBeforeItsMeanIsRoughAndTheFiltersRingAfterIt) {
  beat_slope = 1.0;
  hear_rough(3.0, 0.001);
  const double begin_s = t_s;
  hear_rough(1.0, 100.0);
  const double end_s = t_s;
  hear_rough(1.0, 0.001);
  EXPECT_FALSE(levels.rough(Instant(from_seconds(begin_s - 0.125))));
  EXPECT_TRUE(levels.rough(Instant(from_seconds(begin_s - 0.075))));
  EXPECT_NEAR(to_seconds(levels.rough_until().time_since_epoch()) - end_s, 0.08 + 0.15, 0.025);
}

}  // namespace
}  // namespace perimap

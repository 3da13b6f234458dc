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
  levels.forget_top();
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

}  // namespace
}  // namespace perimap

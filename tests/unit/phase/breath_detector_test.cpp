// Breaths in a respiration channel: made-up waveforms of patients and ventilators, disturbed.
#include "core/phase/breath_detector.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

Instant at_s(double seconds) { return Instant(from_seconds(seconds)); }

// A function of the share of the breath, 0 to 1.
using Shape = std::function<double(double)>;

double sine(double share) { return 0.5 - 0.5 * std::cos(kTwoPi * share); }
// A ventilator: a fast rise, a plateau, and the lung's exponential emptying.
double ventilator(double share) {
  if (share < 0.08) return share / 0.08;
  return share < 0.33 ? 1.0 : std::exp(-(share - 0.33) / 0.08);
}
double trapezoid(double share) {
  if (share < 0.1) return share / 0.1;
  if (share < 0.35) return 1.0;
  return share < 0.5 ? (0.5 - share) / 0.15 : 0.0;
}

// From the first instant to the last, at this rate.
void play(BreathDetector& detector, double from_s, double to_s, double rate_hz,
          const std::function<double(double)>& value) {
  for (double t = from_s; t < to_s; t += 1.0 / rate_hz) detector.push(at_s(t), value(t));
}

// Onsets as the detector tells them while it plays, s, where the period is known.
std::vector<double> onsets(BreathDetector& detector, double to_s, double rate_hz,
                           const std::function<double(double)>& value) {
  std::vector<double> found;
  std::uint64_t seen = 0;
  for (double t = 0.0; t < to_s; t += 1.0 / rate_hz) {
    detector.push(at_s(t), value(t));
    const BreathSignal& signal = detector.signal();
    if (signal.onsets == seen) continue;
    seen = signal.onsets;
    if (signal.known(at_s(t))) found.push_back(to_seconds(signal.onset.time_since_epoch()));
  }
  return found;
}

struct Case {
  std::string name;
  Shape shape;
  double gain;
  double worst;  // of the period: an onset from where the mean one lies in its breath
};

class RegularBreath : public testing::TestWithParam<Case> {};

TEST_P(RegularBreath, IsKnownAfterThreeOnsetsAndKeptToItsPeriod) {
  for (const double period_s : {2.2, 4.0, 8.0}) {
    for (const double rate_hz : {25.0, 125.0, 500.0}) {
      std::mt19937 generator(3);
      std::normal_distribution<double> noise(0.0, 0.03);
      BreathDetector detector;
      const auto found = onsets(detector, 20.0 * period_s, rate_hz, [&](double t) {
        const double wander = 0.5 * std::sin(kTwoPi * t / 60.0);
        const double heart = 0.1 * std::sin(kTwoPi * t * 1.3);
        return GetParam().gain * (GetParam().shape(std::fmod(t / period_s, 1.0)) + wander + heart + noise(generator));
      });
      ASSERT_GE(found.size(), 15U) << period_s << " s at " << rate_hz << " Hz";
      EXPECT_LE(found.size(), 20U);
      double mean = 0.0;
      for (const double onset : found) mean += std::fmod(onset / period_s, 1.0) / static_cast<double>(found.size());
      for (const double onset : found) {
        EXPECT_NEAR(period_s * std::remainder(onset / period_s - mean, 1.0), 0.0, GetParam().worst * period_s);
      }
      EXPECT_NEAR(to_seconds(detector.signal().period), period_s, GetParam().worst * period_s);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(BreathDetector, RegularBreath,
                         testing::Values(Case{"sine", sine, 1.0, 0.1}, Case{"sine_inverted", sine, -250.0, 0.1},
                                         Case{"ventilator", ventilator, 1e-3, 0.03},
                                         Case{"trapezoid", trapezoid, 40.0, 0.035}),
                         [](const auto& tested) { return tested.param.name; });

TEST(BreathDetector, SaysNothingOfASilentChannelOrOfNoiseOrOfHeartBeats) {
  for (const int seed : {1, 2, 3, 4, 5}) {
    for (const double noise_level : {0.0, 1.0}) {
      for (const double heart : {0.0, 1.0}) {
        std::mt19937 generator(static_cast<unsigned>(seed));
        std::normal_distribution<double> noise(0.0, 1.0);
        BreathDetector detector;
        for (double t = 0.0; t < 300.0; t += 0.008) {
          detector.push(at_s(t), 3.0 + noise_level * noise(generator) + heart * std::sin(kTwoPi * 1.2 * t));
          ASSERT_FALSE(detector.signal().known(at_s(t))) << "seed " << seed << " at " << t << " s";
        }
      }
    }
  }
}

TEST(BreathDetector, APauseIsToldAndTheBreathAfterItIsFoundAgain) {
  BreathDetector detector;
  const auto breath = [](double t) { return ventilator(std::fmod(t / 4.0, 1.0)); };
  play(detector, 0.0, 40.0, 125.0, breath);
  EXPECT_TRUE(detector.signal().known(at_s(40.0)));
  // The pause begins where a breath would.
  double told_s = 0.0;
  for (double t = 40.0; t < 60.0; t += 0.008) {
    detector.push(at_s(t), 0.0);
    if (told_s == 0.0 && !detector.signal().known(at_s(t))) told_s = t;
  }
  EXPECT_GT(told_s, 40.0);
  EXPECT_LT(told_s, 43.0);
  double found_s = 0.0;
  for (double t = 60.0; t < 80.0 && found_s == 0.0; t += 0.008) {
    detector.push(at_s(t), breath(t));
    if (detector.signal().known(at_s(t))) found_s = t;
  }
  EXPECT_GT(found_s, 64.0) << "a period has to be seen";
  EXPECT_LT(found_s, 65.0);
}

TEST(BreathDetector, FollowsAChangeOfTheVentilatorsRate) {
  BreathDetector detector;
  play(detector, 0.0, 40.0, 125.0, [](double t) { return trapezoid(std::fmod(t / 4.0, 1.0)); });
  EXPECT_NEAR(to_seconds(detector.signal().period), 4.0, 0.02);
  play(detector, 40.0, 52.0, 125.0, [](double t) { return trapezoid(std::fmod((t - 40.0) / 2.5, 1.0)); });
  EXPECT_NEAR(to_seconds(detector.signal().period), 2.5, 0.02);
}

TEST(BreathDetector, WhatIsNotHeardIsNotKnown) {
  BreathDetector detector;
  const auto breath = [](double t) { return sine(std::fmod(t / 4.0, 1.0)); };
  play(detector, 0.0, 30.0, 125.0, breath);
  EXPECT_TRUE(detector.signal().known(at_s(30.2)));
  EXPECT_FALSE(detector.signal().known(at_s(30.8))) << "nothing came";
  detector.interrupt();
  EXPECT_FALSE(detector.signal().known(at_s(30.1))) << "the sensor is off";
  play(detector, 31.0, 33.0, 125.0, breath);
  EXPECT_FALSE(detector.signal().known(at_s(33.0)));
  play(detector, 33.0, 50.0, 125.0, breath);
  EXPECT_TRUE(detector.signal().known(at_s(50.0)));
  detector.push(at_s(50.01), NAN);
  EXPECT_FALSE(detector.signal().known(at_s(50.01)));
}

}  // namespace
}  // namespace perimap

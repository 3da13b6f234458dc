#include "core/estimation/feature_health.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace perimap {
namespace {

// NIS of a filter whose innovations are `scale` times as spread as it believes, seeded.
class Innovations {
 public:
  explicit Innovations(unsigned seed) : generator_(seed) {}
  double nis(double scale) {
    const double a = normal_(generator_);
    const double b = normal_(generator_);
    return scale * scale * (a * a + b * b);
  }

 private:
  std::mt19937 generator_;
  std::normal_distribution<double> normal_;
};

constexpr double kGate = 13.8;

HealthAction feed(FeatureHealth& health, Innovations& innovations, double scale, int updates) {
  HealthAction strongest = HealthAction::kNone;
  for (int i = 0; i < updates; ++i) {
    const double nis = innovations.nis(scale);
    strongest = std::max(strongest, health.add(nis, nis < kGate));
  }
  return strongest;
}

TEST(FeatureHealth, ConsistentInnovationsTurnNothingOn) {
  int noisy = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    FeatureHealth health;
    Innovations innovations(seed);
    EXPECT_EQ(feed(health, innovations, 1.0, 3600), HealthAction::kNone);
    noisy += health.process_noise() > 0.0 ? 1 : 0;
    EXPECT_TRUE(health.state() == HealthState::kConsistent || health.state() == HealthState::kDrifting);
  }
  EXPECT_LE(noisy, 2) << "of 200 features over two minutes";
}

// How many of so many features have process noise after a minute of innovations `scale` times as spread as believed, of
// which nine tenths are common to a cycle of 15 updates in one direction, and nothing in the other; seeded.
int drifting_after_cycles(unsigned features, double scale) {
  constexpr double kCommon = 0.9;
  int drifting = 0;
  for (unsigned seed = 0; seed < features; ++seed) {
    FeatureHealth health;
    std::mt19937 generator(seed);
    std::normal_distribution<double> normal;
    for (int cycle = 0; cycle < 120; ++cycle) {
      health.begin_cycle();
      const double shared = normal(generator);
      for (int i = 0; i < 15; ++i) {
        const double along = std::sqrt(kCommon) * shared + std::sqrt(1.0 - kCommon) * normal(generator);
        const double nis = scale * scale * (along * along + std::pow(normal(generator), 2));
        (void)health.add(nis, nis < kGate, kCommon);
      }
    }
    drifting += health.process_noise() > 0.0 ? 1 : 0;
  }
  return drifting;
}

TEST(FeatureHealth, ErrorsCommonToACyclesUpdatesAreNoDrift) { EXPECT_LE(drifting_after_cycles(200, 1.0), 4); }

TEST(FeatureHealth, DriftShowsAmongErrorsCommonToACyclesUpdates) { EXPECT_GE(drifting_after_cycles(100, 1.3), 90); }

TEST(FeatureHealth, AFewGrossOutliersTurnNothingOn) {
  FeatureHealth health;
  Innovations innovations(7);
  std::mt19937 generator(8);
  for (int i = 0; i < 3600; ++i) {
    const double nis = generator() % 20 == 0 ? 400.0 : innovations.nis(1.0);
    EXPECT_NE(health.add(nis, nis < kGate), HealthAction::kStartAnew);
  }
  EXPECT_EQ(health.process_noise(), 0.0);
}

TEST(FeatureHealth, DriftTurnsProcessNoiseOnByStepsAndCalmTurnsItOff) {
  FeatureHealth health;
  Innovations innovations(3);
  EXPECT_EQ(feed(health, innovations, 1.22, 250), HealthAction::kNone);
  EXPECT_EQ(health.process_noise(), 0.01);
  EXPECT_EQ(health.state(), HealthState::kDrifting);
  EXPECT_EQ(feed(health, innovations, 1.22, 300), HealthAction::kNone);
  EXPECT_EQ(health.process_noise(), 0.03);
  feed(health, innovations, 0.98, 2000);
  EXPECT_EQ(health.process_noise(), 0.0);
  EXPECT_EQ(health.state(), HealthState::kConsistent);
}

TEST(FeatureHealth, HighInnovationsInflateOnceThenStartAnewOnce) {
  FeatureHealth health;
  Innovations innovations(4);
  feed(health, innovations, 1.0, 200);
  int inflated = 0;
  int started_anew = 0;
  for (int i = 0; i < 400; ++i) {
    const double nis = innovations.nis(4.0);
    const HealthAction action = health.add(nis, nis < kGate);
    inflated += action == HealthAction::kInflate ? 1 : 0;
    started_anew += action == HealthAction::kStartAnew ? 1 : 0;
  }
  EXPECT_EQ(inflated, 1);
  EXPECT_EQ(started_anew, 1);
  EXPECT_EQ(health.state(), HealthState::kFailed);
  health.reset();
  EXPECT_EQ(health.state(), HealthState::kUndecided);
  EXPECT_EQ(health.process_noise(), 0.0);
}

TEST(FeatureHealth, InflationThatHelpsIsEnough) {
  FeatureHealth health;
  Innovations innovations(5);
  feed(health, innovations, 1.0, 200);
  EXPECT_EQ(feed(health, innovations, 4.0, 50), HealthAction::kNone) << "it may pass";
  EXPECT_EQ(health.state(), HealthState::kInconsistent);
  EXPECT_EQ(feed(health, innovations, 4.0, 50), HealthAction::kInflate);
  EXPECT_EQ(feed(health, innovations, 1.0, 900), HealthAction::kNone);
  EXPECT_NE(health.state(), HealthState::kInconsistent);
  EXPECT_EQ(feed(health, innovations, 4.0, 100), HealthAction::kInflate) << "a later jump is met afresh";
}

TEST(FeatureHealth, ARefusedUpdateCountsAsAnOutlierWhateverItsInnovation) {
  for (const double nis : {0.0, 2.0, std::nan("")}) {
    FeatureHealth health;
    HealthAction strongest = HealthAction::kNone;
    for (int i = 0; i < 300; ++i) strongest = std::max(strongest, health.add(nis, false));
    EXPECT_EQ(strongest, HealthAction::kStartAnew) << nis;
  }
}

}  // namespace
}  // namespace perimap

// What disturbs the line: how long it is remembered, and what is unlike any beat whatever else is known.
#include "core/phase/line_disturbances.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/phase/ecg_filter.hpp"

namespace perimap::test {
namespace {

class Disturbances : public ::testing::Test {
 protected:
  const DecisionSettings settings_{};
  const EcgLevelSettings level_settings_{};
  const EcgLevels levels_{level_settings_};
  LineDisturbances disturbances_{settings_, levels_};
  const Instant t_ = Instant{} + from_seconds(10.0);
};

TEST_F(Disturbances, AreForgottenWithinSecondsAndNoSooner) {
  disturbances_.note(t_, 1.0);
  EXPECT_EQ(disturbances_.at(t_), 1.0);
  EXPECT_NEAR(disturbances_.at(t_ + from_seconds(1.5)), std::exp(-1.0), 1e-9);
  EXPECT_LT(disturbances_.at(t_ + from_seconds(10.0)), 0.01);
}

TEST_F(Disturbances, NoMoreThanThreeCountAtATime) {
  for (int i = 0; i < 20; ++i) disturbances_.note(t_, 1.0);
  EXPECT_EQ(disturbances_.at(t_), 3.0);
}

TEST_F(Disturbances, OneThatIsNotedLateDoesNotMakeTheLastOneEarlier) {
  disturbances_.note(t_, 1.0);
  disturbances_.note(t_ - from_seconds(0.3), 1.0);
  EXPECT_EQ(disturbances_.last_at(), t_);
  EXPECT_EQ(disturbances_.at(t_), 2.0);
}

TEST_F(Disturbances, AreOverWhenClearedAndTheLastOnesTimeIsStillKnown) {
  disturbances_.note(t_, 1.0);
  disturbances_.clear();
  EXPECT_EQ(disturbances_.at(t_), 0.0);
  EXPECT_EQ(disturbances_.last_at(), t_);
}

TEST_F(Disturbances, AStepAndWhatIsTooFastForAHeartAreUnlikeAnyBeat) {
  QrsCandidate candidate;
  candidate.energy = 1.0;
  EXPECT_FALSE(disturbances_.unlike_any_beat(candidate));
  candidate.step = settings_.most_step * 1.1;
  EXPECT_TRUE(disturbances_.unlike_any_beat(candidate));
  candidate.step = 0.0;
  candidate.rough = settings_.most_rough * 1.1;
  EXPECT_TRUE(disturbances_.unlike_any_beat(candidate));
}

TEST_F(Disturbances, WhatStandsOutIsSeveralTimesAsLargeAsTheNoise) {
  QrsCandidate candidate;
  candidate.energy = 3.0;
  EXPECT_FALSE(disturbances_.stands_out(candidate, 1.0));
  candidate.energy = 4.0;
  EXPECT_TRUE(disturbances_.stands_out(candidate, 1.0));
}

// Noise that is always there counts from where, bare, its largest come up to seven tenths of half a beat: a half of the
// power at which they reach half a beat.
TEST(SteadyNoise, CountsForWhatIsLikeNoKindWhereItComesNearToTheBeats) {
  const EcgLevelSettings level_settings;
  EcgLevels levels{level_settings};
  EcgFilter filter;
  filter.restart(from_seconds(1.0 / 250.0));
  std::mt19937_64 generator(0x3c6ef372fe94f82bU);
  std::normal_distribution<double> noise(0.0, 0.1);
  for (int i = 0; i < 15 * 250; ++i) {
    filter.push(Instant{} + from_seconds(i / 250.0), noise(generator), false);
    levels.follow(filter, 0.0, false);
  }
  ASSERT_GT(levels.noise(), 0.0);
  const DecisionSettings settings;
  const LineDisturbances disturbances{settings, levels};
  const auto beats_in = [&](double noisiness) {
    QrsCandidate beat;
    beat.energy = 3.49 * levels.noise() / (0.5 * std::sqrt(noisiness));
    BeatLevels beats;
    beats.learn(beat);
    return beats;
  };
  EXPECT_FALSE(disturbances.near_to_beats(beats_in(0.45)));
  EXPECT_EQ(disturbances.steady(beats_in(0.45)), 0.0);
  EXPECT_TRUE(disturbances.near_to_beats(beats_in(0.55)));
  EXPECT_NEAR(disturbances.steady(beats_in(0.55)), 3.0 * 0.55, 0.01);
}

TEST_F(Disturbances, ALineWithoutNoiseCountsAsNone) {
  EXPECT_EQ(disturbances_.steady(BeatLevels{}), 0.0);
  EXPECT_FALSE(disturbances_.near_to_beats(BeatLevels{}));
}

}  // namespace
}  // namespace perimap::test

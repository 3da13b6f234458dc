// What disturbs the line: how long it is remembered, and what is unlike any beat whatever else is known.
#include "core/phase/line_disturbances.hpp"

#include <gtest/gtest.h>

#include <cmath>

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

TEST_F(Disturbances, ALineWithoutNoiseCountsAsNone) {
  EXPECT_EQ(disturbances_.steady(BeatLevels{}), 0.0);
  EXPECT_FALSE(disturbances_.near_to_beats(BeatLevels{}));
}

}  // namespace
}  // namespace perimap::test

#include "core/phase/rhythm_scatter.hpp"

#include <gtest/gtest.h>

namespace perimap {
namespace {

TEST(RhythmScatter, IsTheMeanOfTheLastTwoDozenIntervals) {
  RhythmScatter scatter;
  for (int i = 0; i < 400; ++i) scatter.learn(i % 2 == 0 ? 0.04 : -0.04);
  EXPECT_NEAR(scatter.mean(), 0.04, 1e-6);
  for (int i = 0; i < 24; ++i) scatter.learn(0.2);
  // To within e^-1 of the way.
  EXPECT_NEAR(scatter.mean(), 0.2 - 0.16 * 0.360, 0.004);
}

TEST(RhythmScatter, AtFirstATenthOfTheCycleIsNothing) { EXPECT_NEAR(RhythmScatter().mean(), 0.1, 0.02); }

TEST(RhythmScatter, ALongPauseCountsAsHalfOfTheLogarithm) {
  RhythmScatter scatter;
  for (int i = 0; i < 400; ++i) scatter.learn(0.0);
  scatter.learn(2.0);
  EXPECT_NEAR(scatter.mean(), 0.5 / 24.0, 0.002);
}

// Half of the last eight intervals and more are within 0.8 % of the cycle, whatever the others are.
TEST(RhythmScatter, APacemakerBeatsLikeClockworkThoughSomeBeatsComeBetween) {
  RhythmScatter scatter;
  for (int i = 0; i < 7; ++i) scatter.learn(0.003);
  EXPECT_FALSE(scatter.like_clockwork()) << "too few";
  scatter.learn(0.003);
  EXPECT_TRUE(scatter.like_clockwork());
  for (int i = 0; i < 3; ++i) scatter.learn(-0.3);
  EXPECT_TRUE(scatter.like_clockwork());
  scatter.learn(-0.3);
  EXPECT_FALSE(scatter.like_clockwork());
}

TEST(RhythmScatter, ASinusNodeDoesNotBeatLikeClockwork) {
  for (const double off : {0.0065, 0.0095}) {
    RhythmScatter scatter;
    for (int i = 0; i < 20; ++i) scatter.learn(i % 2 == 0 ? off : -off);
    EXPECT_EQ(scatter.like_clockwork(), off < 0.008);
  }
}

}  // namespace
}  // namespace perimap

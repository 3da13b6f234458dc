#include "core/phase/beat_kinds.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace perimap {
namespace {

// One period of a sine, with a wave beside it; its size, and noise.
QrsShape beat(double beside, double size = 1.0, double noise = 0.0, std::mt19937* generator = nullptr) {
  QrsShape shape;
  shape.points = 29;
  for (int i = 0; i < shape.points; ++i) {
    double slope = std::sin(0.22 * i) + beside * std::sin(0.44 * i);
    // No normal distribution: what is drawn from it differs from one standard library to another.
    if (generator != nullptr) slope += noise * (static_cast<double>((*generator)() % 2001U) / 1000.0 - 1.0);
    shape.slope[static_cast<std::size_t>(i)] = static_cast<float>(size * slope);
  }
  return shape;
}

class Kinds : public testing::Test {
 protected:
  BeatKinds::Comparison see(const QrsShape& shape, double log_rr = 0.0) {
    const BeatKinds::Comparison compared = kinds_.compare(shape);
    kinds_.learn(shape, compared, log_rr);
    return compared;
  }
  void usual_beats(int count, double noise) {
    for (int i = 0; i < count; ++i) see(beat(0.0, 1.0, noise, &generator_), 0.01);
  }

  std::mt19937 generator_{5};
  BeatKinds kinds_;
};

TEST_F(Kinds, UsualBeatsAreUnlikeByOne) {
  usual_beats(60, 0.1);
  double sum = 0.0;
  for (int i = 0; i < 200; ++i) sum += see(beat(0.0, 1.0, 0.1, &generator_)).unlike;
  EXPECT_NEAR(sum / 200.0, 1.0, 0.25);
}

TEST_F(Kinds, WhatIsFarFromUsualWhereBeatsAreAlikeIsNotWhereTheyScatter) {
  usual_beats(60, 0.03);
  const double where_alike = kinds_.compare(beat(0.3)).unlike;
  kinds_ = {};
  usual_beats(60, 0.3);
  const double where_not = kinds_.compare(beat(0.3)).unlike;
  EXPECT_GT(where_alike, 20.0);
  EXPECT_LT(where_not, 3.0);
}

// A sine of twice the frequency changes twice as fast.
TEST_F(Kinds, WhatIsNarrowerChangesFaster) {
  QrsShape narrow;
  narrow.points = 29;
  for (std::size_t i = 0; i < 29; ++i)
    narrow.slope[i] = static_cast<float>(2.5 * std::sin(0.44 * static_cast<double>(i)));
  usual_beats(2, 0.0);
  EXPECT_EQ(kinds_.compare(narrow).narrower, 0.0) << "nothing is known yet";
  usual_beats(5, 0.0);
  EXPECT_NEAR(kinds_.compare(narrow).narrower, std::log(2.0), 0.05);
  EXPECT_NEAR(kinds_.compare(beat(0.0, 3.0)).narrower, 0.0, 1e-3) << "whatever its size";
  EXPECT_EQ(kinds_.compare(QrsShape{}).narrower, 0.0);
}

// 3 % of the shape's size at least.
TEST_F(Kinds, BeatsWithoutAnyNoiseAreAllowedAFewPerCent) {
  usual_beats(300, 0.0);
  EXPECT_NEAR(kinds_.compare(beat(0.0, 1.03)).unlike, 1.0, 0.2);
}

TEST_F(Kinds, NothingIsUnlikeBeforeThreeBeats) {
  usual_beats(2, 0.0);
  EXPECT_EQ(kinds_.compare(beat(1.0)).unlike, 0.0);
  usual_beats(1, 0.0);
  EXPECT_GT(kinds_.compare(beat(1.0)).unlike, 10.0);
}

// Tenths of the shape's size, while the first beats tell little of how they scatter.
TEST_F(Kinds, TheFirstBeatsAreHeldAgainstAGuessOfTheirScatter) {
  usual_beats(3, 0.0);
  EXPECT_NEAR(kinds_.compare(beat(0.0, 1.1)).unlike, 2.36, 0.25);
}

TEST_F(Kinds, AnotherSizeIsAnotherKindAndSoIsAnotherShape) {
  usual_beats(20, 0.02);
  EXPECT_TRUE(kinds_.compare(beat(0.0, 0.75)).usual);
  EXPECT_FALSE(kinds_.compare(beat(0.0, 0.68)).usual);
  EXPECT_TRUE(kinds_.compare(beat(0.3)).usual);
  EXPECT_FALSE(kinds_.compare(beat(0.42)).usual);
}

TEST_F(Kinds, AKindIsCoupledOnceItHasComeEarlyByTheSameTimeThreeTimes) {
  usual_beats(40, 0.05);
  const QrsShape other = beat(0.0, 0.55);
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(see(other, -0.3 + 0.01 * i).coupled) << i;
  EXPECT_TRUE(see(other, -0.3).coupled);
}

TEST_F(Kinds, HowTheIntervalsBeforeAKindScatterIsKnownFromFourOn) {
  usual_beats(80, 0.05);
  const QrsShape other = beat(0.0, 0.55);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(see(other, i % 2 == 0 ? -0.4 : -0.2).scatter, 0.0) << i;
  EXPECT_NEAR(kinds_.compare(other).log_rr, -0.3, 0.01);
  EXPECT_GT(kinds_.compare(other).scatter, 0.1);
  for (int i = 0; i < 28; ++i) see(other, -0.35);
  EXPECT_NEAR(kinds_.compare(other).log_rr, -0.35, 0.02);
  EXPECT_LT(kinds_.compare(other).scatter, 0.03);
}

// As if another interval, three tenths beside the others, had been among them.
TEST_F(Kinds, TheFirstIntervalsOfAKindAreTakenToScatter) {
  const auto coupled = [&](double second) {
    kinds_ = {};
    usual_beats(40, 0.05);
    for (const double log_rr : {-0.3, second, -0.3}) see(beat(0.0, 0.55), log_rr);
    return kinds_.compare(beat(0.0, 0.55)).coupled;
  };
  EXPECT_TRUE(coupled(-0.24));
  EXPECT_FALSE(coupled(-0.18));
}

TEST_F(Kinds, AKindIsNotCoupledOnTimeNorAtAnyTimeNorWhenItIsHardlyAnother) {
  const auto coupled = [&](const QrsShape& other, double log_rr, double scatter, double noise) {
    kinds_ = {};
    usual_beats(60, noise);
    for (int i = 0; i < 40; ++i) see(other, log_rr + (i % 2 == 0 ? scatter : -scatter));
    return kinds_.compare(other).coupled;
  };
  EXPECT_TRUE(coupled(beat(0.0, 0.55), -0.09, 0.0, 0.05));
  EXPECT_FALSE(coupled(beat(0.0, 0.55), -0.07, 0.0, 0.05));
  EXPECT_TRUE(coupled(beat(0.0, 0.55), -0.3, 0.12, 0.05));
  EXPECT_FALSE(coupled(beat(0.0, 0.55), -0.3, 0.16, 0.05));
  // Unlike by seven and by five, as far as usual beats scatter.
  EXPECT_TRUE(coupled(beat(0.0, 0.66), -0.3, 0.0, 0.15));
  EXPECT_FALSE(coupled(beat(0.0, 0.66), -0.3, 0.0, 0.18));
}

TEST_F(Kinds, AKindIsApartOnceItHasRecurredAndIsUnlikeTheUsualOneByMoreThanNoiseIs) {
  const auto apart = [&](int members, double noise) {
    kinds_ = {};
    usual_beats(60, noise);
    for (int i = 0; i < members; ++i) see(beat(0.0, 0.5));
    return kinds_.compare(beat(0.0, 0.5)).apart;
  };
  EXPECT_FALSE(apart(2, 0.03));
  EXPECT_FALSE(kinds_.compare(beat(0.0, 0.5)).recurs);
  EXPECT_TRUE(apart(3, 0.03));
  EXPECT_TRUE(kinds_.compare(beat(0.0, 0.5)).recurs);
  // By 65 and by 45.
  EXPECT_TRUE(apart(3, 0.069));
  EXPECT_FALSE(apart(3, 0.085));
}

TEST_F(Kinds, AKindThatHasComeOnTimeSixteenTimesIsNotCoupledForMuchLonger) {
  usual_beats(90, 0.05);
  const QrsShape other = beat(0.0, 0.55);
  const auto times = [&](int count, double log_rr) {
    for (int i = 0; i < count; ++i) see(other, log_rr);
  };
  times(30, -0.3);
  times(17, 0.001);
  EXPECT_TRUE(kinds_.compare(other).coupled);
  times(7, 0.001);
  EXPECT_FALSE(kinds_.compare(other).coupled);
}

// The gain falls by a fifth; what is of the usual kind shows where its mean is.
TEST_F(Kinds, TheUsualBeatFollowsTheGainByAnEighthABeat) {
  for (int i = 0; i < 60; ++i) see(beat(0.0));
  for (int i = 0; i < 8; ++i) see(beat(0.0, 0.8));
  EXPECT_TRUE(kinds_.compare(beat(0.0, 0.622)).usual);
  EXPECT_FALSE(kinds_.compare(beat(0.0, 0.607)).usual);
}

TEST_F(Kinds, TheScatterOfUsualBeatsIsThatOfTheLastThirty) {
  usual_beats(80, 0.3);
  for (int i = 0; i < 20; ++i) see(beat(0.0));
  const double unlike = kinds_.compare(beat(0.0, 1.2)).unlike;
  EXPECT_NEAR(unlike, 1.12, 0.12);
}

// A narrow complex, so many steps later.
QrsShape displaced(int steps) {
  QrsShape shape;
  shape.points = 29;
  for (int i = 0; i < shape.points; ++i) {
    const double x = (i - 12.0 - steps) / 1.2;
    shape.slope[static_cast<std::size_t>(i)] = static_cast<float>(-x * std::exp(-0.5 * x * x));
  }
  return shape;
}

TEST_F(Kinds, PeaksOfOneKindAreFoundUpToFifteenMillisecondsApartAndTwentyMakeABeatUnlikeNone) {
  for (int i = 0; i < 20; ++i) see(displaced(0));
  EXPECT_TRUE(kinds_.compare(displaced(3)).usual);
  EXPECT_FALSE(kinds_.compare(displaced(4)).usual);
  EXPECT_LT(kinds_.compare(displaced(4)).unlike, 1.0);
  EXPECT_GT(kinds_.compare(displaced(5)).unlike, 10.0);
}

TEST_F(Kinds, TheUsualKindFollowsTheHeart) {
  usual_beats(20, 0.02);
  for (int i = 0; i < 60; ++i) see(beat(1.0));
  EXPECT_TRUE(kinds_.compare(beat(1.0)).usual);
  EXPECT_FALSE(kinds_.compare(beat(0.0)).usual);
}

// Two minutes of ventricular beats do not make the usual one of what they are.
TEST_F(Kinds, TheUsualKindIsThatOfTheLastFiveHundredBeats) {
  usual_beats(300, 0.02);
  for (int i = 0; i < 160; ++i) see(beat(1.0));
  EXPECT_TRUE(kinds_.compare(beat(0.0)).usual);
  for (int i = 0; i < 50; ++i) see(beat(1.0));
  EXPECT_TRUE(kinds_.compare(beat(1.0)).usual);
}

}  // namespace
}  // namespace perimap

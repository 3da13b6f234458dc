// What keeps a beat from being believed, each circumstance alone.
#include "core/phase/beat_confidence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace perimap::test {
namespace {

const DecisionSettings kSettings;

using Circumstance = std::function<void(BeatCircumstances&)>;

// A beat of a kind that is long known, on time, on a calm line, and what is different.
double told(const Circumstance& change) {
  BeatCircumstances beat;
  beat.probability = 0.99;
  beat.familiar = true;
  beat.long_known = true;
  beat.any_known = true;
  beat.heard_for_long = true;
  change(beat);
  return confidence(beat, kSettings);
}

constexpr double kDoubtful = 0.5;
constexpr double kBelieved = 0.9;

TEST(BeatConfidence, AUsualBeatIsAsSureAsItIsProbable) {
  EXPECT_GT(told([](BeatCircumstances&) {}), kBelieved);
  EXPECT_EQ(told([](BeatCircumstances& b) { b.probability = 0.7, b.long_known = b.heard_for_long = false; }), 0.7);
  EXPECT_EQ(told([](BeatCircumstances& b) { b.probability = 0.3, b.unlike_any_beat = true; }), 0.3);
}

// Of those that were told with a probability of 0.7 nearly all were beats.
TEST(BeatConfidence, ABeatThatNothingSpeaksAgainstIsBelievedMoreThanItIsProbable) {
  const auto probable = [](double probability, double disturbances, bool long_known) {
    return told([&](BeatCircumstances& b) {
      b.probability = probability, b.disturbed = disturbances, b.long_known = long_known, b.heard_for_long = long_known;
    });
  };
  EXPECT_NEAR(probable(0.7, 0.0, true), 0.91, 1e-9);
  EXPECT_NEAR(probable(0.6, 0.25, true), 0.84, 1e-9);
  EXPECT_EQ(probable(0.7, 0.35, true), 0.7) << "noise";
  EXPECT_EQ(probable(0.7, 0.0, false), 0.7) << "of a kind that a burst may have made";
  EXPECT_EQ(told([](BeatCircumstances& b) { b.probability = 0.7, b.rivalled = true; }), kDoubtful);
}

TEST(BeatConfidence, InNoiseThatIsAlwaysThereNothingIsBelieved) {
  EXPECT_EQ(told([](BeatCircumstances& b) { b.in_steady_noise = true; }), kDoubtful);
}

TEST(BeatConfidence, ABeatWhoseKindComesEarlyIsNoMoreSuspiciousForThat) {
  const auto early = [](double of_cycle, double usual) {
    return told([&](BeatCircumstances& b) { b.correlation = 0.95, b.of_cycle = of_cycle, b.usual_of_cycle = usual; });
  };
  EXPECT_EQ(early(0.7, 1.0), kDoubtful);
  EXPECT_GT(early(0.7, 0.7), kBelieved);
  EXPECT_GT(early(0.62, 0.7), kBelieved);  // .05 x (1 + 2.02) = .151
  EXPECT_EQ(early(0.55, 0.7), kDoubtful);  // .05 x (1 + 4.02) = .251
}

TEST(BeatConfidence, ABeatBesideWhichAnotherLooksAsMuchLikeAQrsComplexIsDoubtful) {
  EXPECT_EQ(told([](BeatCircumstances& b) { b.rivalled = true; }), kDoubtful);
}

TEST(BeatConfidence, OnTimeAndInCalmABeatMayDifferAsBeatsDo) {
  EXPECT_GT(told([](BeatCircumstances& b) { b.correlation = 0.84; }), kBelieved);
  EXPECT_EQ(told([](BeatCircumstances& b) { b.correlation = 0.82; }), kDoubtful);
  EXPECT_GT(told([](BeatCircumstances& b) { b.correlation = 0.90, b.gain = std::exp(0.6); }), kBelieved);
  EXPECT_EQ(told([](BeatCircumstances& b) { b.correlation = 0.90, b.gain = std::exp(-0.8); }), kDoubtful);
}

// In deviations of the rhythm: in fibrillation beats come at any time.
TEST(BeatConfidence, TheEarlierItComesTheMoreItMustBeLikeItsKind) {
  const auto early = [](double correlation, double of_cycle, double spread) {
    return told([&](BeatCircumstances& b) { b.correlation = correlation, b.of_cycle = of_cycle, b.spread = spread; });
  };
  EXPECT_GT(early(0.97, 0.80, 0.06), kBelieved);  // .03 x (1 + 3.72) = .142
  EXPECT_EQ(early(0.95, 0.80, 0.06), kDoubtful);  // .05 x 4.72 = .236
  EXPECT_EQ(early(0.97, 0.70, 0.06), kDoubtful);  // .03 x 6.94 = .208
  EXPECT_GT(early(0.93, 0.70, 0.30), kBelieved);  // .07 x 2.19 = .153
  EXPECT_GT(early(0.95, 1.60, 0.06), kBelieved) << "a pause is none";
  EXPECT_GT(early(1.0, 0.40, 0.06), kBelieved) << "no arc is exactly like a beat";
}

TEST(BeatConfidence, TheMoreDisturbancesThereAreTheMoreItMustBeLikeItsKind) {
  const auto disturbed = [](double correlation, double disturbances) {
    return told([&](BeatCircumstances& b) { b.correlation = correlation, b.disturbed = disturbances; });
  };
  EXPECT_GT(disturbed(0.95, 0.5), kBelieved);   // .05 x 3 = .15
  EXPECT_EQ(disturbed(0.95, 0.7), kDoubtful);   // .05 x 3.8 = .19
  EXPECT_GT(disturbed(0.985, 2.3), kBelieved);  // .015 x 10.2 = .153
}

TEST(BeatConfidence, AKindIsBelievedWhenItHasBeenKnownForLongerThanBurstsLast) {
  const auto young = [](double disturbances, bool heard_for_long) {
    return told([&](BeatCircumstances& b) {
      b.long_known = false, b.heard_for_long = heard_for_long, b.disturbed = disturbances;
    });
  };
  EXPECT_EQ(young(0.0, true), kDoubtful);
  EXPECT_GT(young(0.0, false), kBelieved) << "at the start none is";
  EXPECT_GT(young(0.25, false), kBelieved);
  EXPECT_EQ(young(0.35, false), kDoubtful);
}

TEST(BeatConfidence, WhatIsOfNoKnownKindIsDoubtfulWhereKindsAreKnown) {
  const auto unfamiliar = [](bool any_known) {
    return told(
        [&](BeatCircumstances& b) { b.familiar = b.long_known = b.heard_for_long = false, b.any_known = any_known; });
  };
  EXPECT_EQ(unfamiliar(true), kDoubtful);
  EXPECT_GT(unfamiliar(false), kBelieved);
}

TEST(BeatConfidence, APWaveAStepAndRoughnessAreDoubtful) {
  EXPECT_EQ(told([](BeatCircumstances& b) { b.may_be_followed = true; }), kDoubtful);
  EXPECT_EQ(told([](BeatCircumstances& b) { b.unlike_any_beat = true; }), kDoubtful);
}

TEST(BeatConfidence, WhatIsLostInNoiseIsABeatOnlyWhereOneIsDue) {
  EXPECT_EQ(told([](BeatCircumstances& b) { b.lost_in_noise = true; }), 0.25);
}

// Of another shape or size, early, among many disturbances: thought noise.
TEST(BeatConfidence, AnEarlyStrangerAmongManyDisturbancesIsNone) {
  const auto stranger = [](double correlation, double log_gain, double disturbances, double of_cycle) {
    return told([&](BeatCircumstances& b) {
      b.correlation = correlation, b.gain = std::exp(log_gain), b.disturbed = disturbances, b.of_cycle = of_cycle;
    });
  };
  EXPECT_EQ(stranger(0.88, 0.0, 1.7, 0.80), 0.1);
  EXPECT_EQ(stranger(0.95, 0.0, 1.7, 0.80), kDoubtful) << "it is alike";
  EXPECT_EQ(stranger(0.95, 0.35, 1.7, 0.80), 0.1) << "but not of one size";
  EXPECT_EQ(stranger(0.95, 0.25, 1.7, 0.80), kDoubtful);
  EXPECT_EQ(stranger(0.88, 0.0, 1.3, 0.80), kDoubtful) << "there are fewer";
  EXPECT_EQ(stranger(0.88, 0.0, 1.7, 0.90), kDoubtful) << "one is due";
}

}  // namespace
}  // namespace perimap::test

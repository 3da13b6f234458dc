#include "core/phase/qrs_clusters.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace perimap {
namespace {

constexpr Instant kNow{Duration(0)};

// The slope of a wave of that height and width in steps.
QrsShape shape(double height, double width, double middle = 18.0) {
  QrsShape s;
  s.points = 28;
  for (int i = 0; i < s.points; ++i) {
    const double x = (i - middle) / width;
    s.slope[static_cast<std::size_t>(i)] = static_cast<float>(-height * x * std::exp(-0.5 * x * x));
  }
  return s;
}

const QrsShape kBeat = shape(1.0, 2.5);
const QrsShape kOther = shape(1.0, 7.0, 12.0);

TEST(QrsClusters, AShapeRecursWhenItWasSeenThreeTimes) {
  QrsClusters clusters;
  const int first = clusters.learn(kBeat, true, true, kNow);
  EXPECT_EQ(clusters.learn(kBeat, true, true, kNow), first);
  EXPECT_FALSE(clusters.any_recurs());
  EXPECT_EQ(clusters.learn(kBeat, true, true, kNow), first);
  EXPECT_TRUE(clusters.recurs(first));
}

TEST(QrsClusters, ShapesAndSizesAreToldApart) {
  QrsClusters clusters;
  const int beat = clusters.learn(kBeat, true, true, kNow);
  EXPECT_NE(clusters.learn(kOther, true, true, kNow), beat);
  EXPECT_NE(clusters.learn(shape(0.4, 2.5), true, true, kNow), beat) << "a P wave may have a QRS complex's shape";
  EXPECT_EQ(clusters.learn(shape(1.4, 2.5), true, true, kNow), beat);
}

TEST(QrsClusters, FindsTheNearestAndItsGain) {
  QrsClusters clusters;
  const int beat = clusters.learn(kBeat, true, true, kNow);
  clusters.learn(kOther, true, true, kNow);
  const ClusterMatch match = clusters.nearest(shape(1.5, 2.6), 3);
  EXPECT_EQ(match.of, beat);
  EXPECT_GT(match.correlation, 0.95);
  EXPECT_NEAR(match.gain, 1.5, 0.1);
}

TEST(QrsClusters, WhatRecursInBurstsAloneIsNotSettled) {
  QrsClusters clusters;
  int beat = -1;
  for (int i = 0; i < 10; ++i) beat = clusters.learn(kBeat, true, false, kNow);
  EXPECT_TRUE(clusters.recurs(beat));
  EXPECT_FALSE(clusters.settled(beat));
  EXPECT_FALSE(clusters.any_settled());
  for (int i = 0; i < 12; ++i) clusters.learn(kBeat, true, true, kNow);
  EXPECT_TRUE(clusters.settled(beat));
}

TEST(QrsClusters, ABurstDoesNotUnsettleTheBeatsBeforeIt) {
  QrsClusters clusters;
  int beat = -1;
  for (int i = 0; i < 60; ++i) beat = clusters.learn(kBeat, true, true, kNow);
  for (int i = 0; i < 25; ++i) clusters.learn(kBeat, true, false, kNow);
  EXPECT_TRUE(clusters.settled(beat));
}

TEST(QrsClusters, CanBeSettledAtOnce) {
  QrsClusters clusters;
  int beat = -1;
  for (int i = 0; i < 6; ++i) beat = clusters.learn(kBeat, true, false, kNow);
  clusters.settle(beat);
  EXPECT_TRUE(clusters.settled(beat));
}

TEST(QrsClusters, KnowsTheShareThatASharperOneFollows) {
  QrsClusters clusters;
  const int wave = clusters.learn(kOther, true, true, kNow);
  for (int i = 0; i < 8; ++i) clusters.followed(wave, i % 2 == 0);
  EXPECT_NEAR(clusters.followers(wave), 0.5, 0.07);
  EXPECT_EQ(clusters.followers_known(wave), 8.0);
}

TEST(QrsClusters, JudgesByTheMeanOfItsMembersAndCautiouslyWhereTheyAreFew) {
  QrsClusters clusters;
  const int beat = clusters.learn(kBeat, true, true, kNow);
  clusters.judged(beat, 3.0);
  EXPECT_GT(clusters.log_odds(beat), 0.0);
  EXPECT_LT(clusters.log_odds(beat), 1.5);
  for (int i = 0; i < 30; ++i) clusters.judged(beat, 3.0);
  EXPECT_NEAR(clusters.log_odds(beat), 3.0, 0.5);
}

}  // namespace
}  // namespace perimap

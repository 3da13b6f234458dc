#include "core/phase/qrs_shape.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace perimap {
namespace {

// The slope of a wave of that height and width in steps.
QrsShape wave(double width, double middle = 16.0, double height = 1.0) {
  QrsShape s;
  s.points = 29;
  for (int i = 0; i < s.points; ++i) {
    const double x = (i - middle) / width;
    s.slope[static_cast<std::size_t>(i)] = static_cast<float>(-height * x * std::exp(-0.5 * x * x));
  }
  return s;
}
const QrsShape kBeat = wave(2.5);
const QrsShape kOther = wave(7.0, 12.0);

// Beside kBeat, as like it as the correlation says.
QrsShape mixed(double correlation) {
  QrsShape other = kOther;
  const double along = match(other, kBeat).gain;
  for (int i = 0; i < other.points; ++i) {
    const auto k = static_cast<std::size_t>(i);
    other.slope[k] -= static_cast<float>(along) * kBeat.slope[k];
  }
  const double across = std::sqrt(1.0 - correlation * correlation) * root_mean_square(kBeat) / root_mean_square(other);
  QrsShape s = kBeat;
  for (int i = 0; i < s.points; ++i) {
    const auto k = static_cast<std::size_t>(i);
    s.slope[k] = static_cast<float>(correlation * static_cast<double>(kBeat.slope[k]) +
                                    across * static_cast<double>(other.slope[k]));
  }
  return s;
}

TEST(QrsShape, CorrelationKnowsNeitherGainNorOffset) {
  EXPECT_NEAR(match(wave(2.5, 16.0, 3.0), kBeat).correlation, 1.0, 1e-6);
  EXPECT_NEAR(match(wave(2.5, 16.0, 3.0), kBeat).gain, 3.0, 1e-5);
  EXPECT_NEAR(match(wave(2.5, 16.0, -1.0), kBeat).correlation, -1.0, 1e-6);
  EXPECT_EQ(match(QrsShape{}, kBeat).correlation, 0.0);
}

TEST(ShapeTemplates, AShapeIsOfATemplateFromACorrelationOfEightyFivePercentOn) {
  ShapeTemplates templates;
  const int beat = templates.learn(kBeat);
  EXPECT_EQ(templates.kind_of(mixed(0.88)), beat);
  EXPECT_EQ(templates.kind_of(mixed(0.82)), -1);
  EXPECT_NE(templates.learn(mixed(0.6)), beat);
}

TEST(ShapeTemplates, OneIsBelievedFromTheFourthBeatOn) {
  ShapeTemplates templates;
  int beat = -1;
  for (int i = 0; i < 3; ++i) beat = templates.learn(kBeat);
  EXPECT_FALSE(templates.usable(beat));
  templates.learn(kBeat);
  EXPECT_TRUE(templates.usable(beat));
}

TEST(ShapeTemplates, PeaksOfOneShapeAreFoundUpToFifteenMillisecondsApart) {
  for (const double apart : {3.0, 4.0}) {
    ShapeTemplates templates;
    const int narrow = templates.learn(wave(1.2, 14.0));
    EXPECT_EQ(templates.learn(wave(1.2, 14.0 + apart)) == narrow, apart == 3.0);
  }
}

TEST(ShapeTemplates, OneFollowsItsBeatsByAnEighthEach) {
  ShapeTemplates templates;
  int beat = -1;
  for (int i = 0; i < 60; ++i) beat = templates.learn(kBeat);
  for (int i = 0; i < 4; ++i) templates.learn(mixed(0.88));
  const double share = 1.0 - std::pow(7.0 / 8.0, 4.0);
  const double across = std::sqrt(1.0 - 0.88 * 0.88) * share;
  const double along = 1.0 - share + 0.88 * share;
  EXPECT_NEAR(std::acos(templates.likeness_to(beat, kBeat, 0)), std::atan(across / along), 0.03);
}

TEST(ShapeTemplates, TheHeaviestIsOfTheLastHundredBeats) {
  ShapeTemplates templates;
  int beat = -1;
  int other = -1;
  for (int i = 0; i < 300; ++i) beat = templates.learn(kBeat);
  for (int i = 0; i < 60; ++i) other = templates.learn(kOther);
  EXPECT_EQ(templates.heaviest(), beat);
  for (int i = 0; i < 20; ++i) templates.learn(kOther);
  EXPECT_EQ(templates.heaviest(), other);
}

}  // namespace
}  // namespace perimap

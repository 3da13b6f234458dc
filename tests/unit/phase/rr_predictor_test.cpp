#include "core/phase/rr_predictor.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace perimap {
namespace {

Seconds next_of(const RrPredictor& predictor) {
  std::array<Seconds, 1> next;
  predictor.predict(next);
  return next[0];
}

// RMS error of one-step predictions on a rhythm that breathing modulates, after the window has filled.
double rms_error(RrMethod method, double* last_deviation = nullptr) {
  std::mt19937 generator(11);
  std::normal_distribution<double> noise(0.0, 0.008);
  RrPredictor predictor(method);
  double squares = 0.0;
  int scored = 0;
  for (int i = 0; i < 400; ++i) {
    const Seconds rr(0.85 + 0.05 * std::sin(2.0 * std::numbers::pi * i / 5.3) + noise(generator));
    if (predictor.count() == RrPredictor::kWindow) {
      squares += std::pow((rr - next_of(predictor)).count(), 2);
      ++scored;
    }
    predictor.push(rr);
  }
  if (last_deviation != nullptr) *last_deviation = predictor.deviation().count();
  return std::sqrt(squares / scored);
}

TEST(RrPredictor, AutoregressionFollowsBreathingBetterThanMeanOrPrevious) {
  const double autoregressive = rms_error(RrMethod::kAutoregressive);
  EXPECT_LT(autoregressive, 0.6 * rms_error(RrMethod::kMeanOf8));
  EXPECT_LT(autoregressive, 0.6 * rms_error(RrMethod::kPrevious));
}

TEST(RrPredictor, StatesItsOwnError) {
  for (const RrMethod method : {RrMethod::kAutoregressive, RrMethod::kMeanOf8, RrMethod::kPrevious}) {
    double stated = 0.0;
    const double true_error = rms_error(method, &stated);
    EXPECT_NEAR(stated / true_error, 1.0, 0.3);
  }
}

// A paced or a fast heart: what a resting one varies by, for which the predictor begins, is twenty times too much.
TEST(RrPredictor, SoonStatesItsOwnErrorOnAnEvenRhythm) {
  std::mt19937 generator(3);
  std::normal_distribution<double> noise(0.0, 0.001);
  RrPredictor predictor;
  for (int i = 0; i < 30; ++i) predictor.push(Seconds(0.49 + noise(generator)));
  EXPECT_GT(predictor.deviation().count(), 0.5e-3);
  EXPECT_LT(predictor.deviation().count(), 3e-3);
}

TEST(RrPredictor, KnowsNothingBeforeTheFirstInterval) {
  const RrPredictor predictor;
  EXPECT_EQ(next_of(predictor).count(), 0.0);
  EXPECT_EQ(predictor.deviation().count(), 0.0);
}

TEST(RrPredictor, GivesThePreviousIntervalUntilThereAreFourteen) {
  RrPredictor predictor;
  std::mt19937 generator(2);
  std::normal_distribution<double> noise(0.8, 0.03);
  for (int i = 1; i < RrPredictor::kOrder + 6; ++i) {
    const Seconds rr(noise(generator));
    predictor.push(rr);
    EXPECT_EQ(next_of(predictor), rr) << i;
  }
  const Seconds last(noise(generator));
  predictor.push(last);
  EXPECT_NE(next_of(predictor), last);
  EXPECT_NEAR(next_of(predictor).count(), 0.8, 0.1);
}

TEST(RrPredictor, ConstantRhythmGivesItself) {
  RrPredictor predictor;
  for (int i = 0; i < 100; ++i) predictor.push(Seconds(0.75));
  std::array<Seconds, 5> next;
  predictor.predict(next);
  for (const Seconds rr : next) EXPECT_NEAR(rr.count(), 0.75, 1e-9);
}

TEST(RrPredictor, FurtherIntervalsAreThoseOfItsOwnForecast) {
  RrPredictor predictor;
  for (int i = 0; i < 60; ++i) predictor.push(Seconds(0.85 + 0.05 * std::sin(i * 1.1)));
  std::array<Seconds, 4> next;
  predictor.predict(next);
  for (int k = 0; k < 4; ++k) {
    EXPECT_NEAR(next[static_cast<std::size_t>(k)].count(), 0.85 + 0.05 * std::sin((60 + k) * 1.1), 0.01);
  }
}

TEST(RrPredictor, ScoringTeachesNothingButTellsInTheDeviation) {
  RrPredictor told;
  RrPredictor spared;
  for (int i = 0; i < 30; ++i) {
    told.push(Seconds(0.8));
    spared.push(Seconds(0.8));
  }
  told.score(Seconds(0.5));
  spared.push(Seconds(0.8));
  EXPECT_GT(told.deviation().count(), 1.5 * spared.deviation().count());
  EXPECT_NEAR(next_of(told).count(), 0.8, 1e-9);
}

// A missed beat and a false one in every twenty intervals: without clipping and a strong ridge the fit follows them.
TEST(RrPredictor, SurvivesOutliers) {
  std::mt19937 generator(4);
  std::normal_distribution<double> noise(0.0, 0.008);
  RrPredictor robust;
  RrPredictor plain(RrMethod::kAutoregressive,
                    {.ridge = 1e-2, .pull = 0.0, .clip = std::numeric_limits<double>::infinity()});
  double robust_squares = 0.0;
  double plain_squares = 0.0;
  for (int i = 0; i < 600; ++i) {
    const double rr = 0.85 + 0.05 * std::sin(2.0 * std::numbers::pi * i / 5.3) + noise(generator);
    if (i > 80) {
      robust_squares += std::pow(next_of(robust).count() - rr, 2);
      plain_squares += std::pow(next_of(plain).count() - rr, 2);
    }
    const Seconds seen(i % 20 == 0 ? 2.0 * rr : i % 20 == 10 ? 0.4 * rr : rr);
    robust.push(seen);
    plain.push(seen);
  }
  EXPECT_LT(std::sqrt(robust_squares), 0.75 * std::sqrt(plain_squares));
}

// Of a rhythm whose pattern it knows well it foretells nothing beyond 0.7 and 1.3 of the mean.
TEST(RrPredictor, StaysWithinBoundsAboutTheMean) {
  RrPredictor predictor(RrMethod::kAutoregressive,
                        {.ridge = 1e-4, .pull = 0.0, .clip = std::numeric_limits<double>::infinity()});
  for (int i = 0; i < 60; ++i) predictor.push(Seconds(i % 4 == 3 ? 1.6 : 0.4));
  std::array<Seconds, 4> next{};
  predictor.predict(next);
  EXPECT_NEAR(next[0].count(), 0.7 * 0.7, 1e-9);
  RrPredictor longer(RrMethod::kAutoregressive,
                     {.ridge = 1e-4, .pull = 0.0, .clip = std::numeric_limits<double>::infinity()});
  for (int i = 0; i < 59; ++i) longer.push(Seconds(i % 4 == 3 ? 1.6 : 0.4));
  longer.predict(next);
  EXPECT_NEAR(next[0].count(), 1.3 * (45 * 0.4 + 14 * 1.6) / 59, 1e-9);
}

// At first 5 % of the interval, worth four beats; then the errors seen, of which none counts for more than half a
// prediction, and which fade within thirty beats.
TEST(RrPredictor, ItsDeviationIsThatOfPastErrorsWhichFade) {
  RrPredictor predictor(RrMethod::kPrevious);
  predictor.push(Seconds(0.8));
  EXPECT_NEAR(predictor.deviation().count(), 0.05 * 0.8, 1e-12);
  predictor.push(Seconds(0.8));
  // The prior's weight has faded from 4 by a sixth.
  const double prior = 4.0 * 5.0 / 6.0;
  EXPECT_NEAR(predictor.deviation().count(), 0.04 * std::sqrt(prior / (prior + 1.0)), 1e-12);
  for (int i = 0; i < 400; ++i) predictor.push(Seconds(0.8));
  predictor.score(Seconds(2.4));
  EXPECT_NEAR(predictor.deviation().count(), 0.4 / std::sqrt(30.0), 1e-4);
  for (int i = 0; i < 30; ++i) predictor.push(Seconds(0.8));
  EXPECT_NEAR(predictor.deviation().count(), 0.4 / std::sqrt(30.0) * std::sqrt(std::pow(29.0 / 30.0, 30)), 1e-4);
}

// A junctional rhythm takes over, or atrial fibrillation ends.
TEST(RrPredictor, FourIntervalsInARowFarToOneSideAreANewRhythm) {
  std::mt19937 generator(6);
  std::normal_distribution<double> noise(0.0, 0.02);
  for (const double changed_s : {1.6, 0.45}) {
    RrPredictor predictor;
    for (int i = 0; i < 60; ++i) predictor.push(Seconds(0.8 + noise(generator)));
    for (int i = 0; i < 3; ++i) predictor.push(Seconds(changed_s));
    EXPECT_NEAR(next_of(predictor).count(), 0.8, 0.1) << "these may be errors";
    predictor.push(Seconds(changed_s + 0.04));
    EXPECT_NEAR(next_of(predictor).count(), changed_s + 0.01, 1e-9);
    std::array<Seconds, 2> both{};
    predictor.predict(both);
    EXPECT_EQ(both[0], both[1]);
    predictor.push(Seconds(0.8));
    EXPECT_NEAR(next_of(predictor).count(), 0.8, 0.1) << "that was all";
  }
}

TEST(RrPredictor, OutliersToBothSidesAreNoNewRhythm) {
  RrPredictor predictor;
  for (int i = 0; i < 60; ++i) predictor.push(Seconds(0.8 + 0.01 * std::sin(i * 1.1)));
  for (const double rr_s : {1.6, 0.4, 1.6, 0.4}) predictor.push(Seconds(rr_s));
  EXPECT_NEAR(next_of(predictor).count(), 0.8, 0.1);
}

}  // namespace
}  // namespace perimap

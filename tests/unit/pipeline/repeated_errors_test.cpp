#include "core/pipeline/repeated_errors.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <array>
#include <random>
#include <vector>

namespace perimap {
namespace {

constexpr std::size_t kViews = 500;

// A place that is the mean of so many matches. There are so many views, one after the other and then again, each with
// an error of its own. Mean square of the place's error by its covariance, 1 where that is right: by the recursion's,
// and by what is told.
std::array<double, 2> consistency(std::size_t matches, double usual_matches = 1.0) {
  const Matrix2d R = (Matrix2d() << 0.4, 0.1, 0.1, 0.2).finished();
  const Matrix2d root = R.llt().matrixL();
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0.0, 1.0);
  constexpr int kTrials = 400;
  double white = 0.0, told = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<Vector2d> errors(static_cast<std::size_t>(static_cast<double>(kViews) / usual_matches));
    for (Vector2d& error : errors) error = root * Vector2d(normal(random), normal(random));
    RepeatedErrors repeated;
    Vector2d mean = Vector2d::Zero();
    for (std::size_t i = 0; i < matches; ++i) {
      mean += errors[i % errors.size()] / static_cast<double>(matches);
      repeated.add(R, R, usual_matches);
    }
    const Matrix2d P = R / static_cast<double>(matches);
    const double by_white = 0.5 * mean.dot(P.inverse() * mean);
    white += by_white / kTrials;
    told += by_white / repeated.factor() / kTrials;
  }
  return {white, told};
}

TEST(RepeatedErrors, AreTheRecursionsOwnUntilAllViewsHaveBeenSeen) {
  for (const std::size_t matches : {60U, 500U}) {
    const auto [white, told] = consistency(matches);
    EXPECT_NEAR(white, 1.0, 0.15) << matches;
    EXPECT_EQ(told, white) << matches;
  }
}

TEST(RepeatedErrors, StayAsTheyAreHoweverManyMatchesFollow) {
  for (const std::size_t times : {2U, 10U}) {
    const auto [white, told] = consistency(times * kViews);
    EXPECT_NEAR(told, 1.0, 0.15) << times;
    EXPECT_NEAR(white, static_cast<double>(times), 0.15 * static_cast<double>(times)) << times;
  }
}

TEST(RepeatedErrors, AreCountedByTheUsualRate) {
  const auto [white, told] = consistency(kViews, 2.0);
  EXPECT_NEAR(told, 1.0, 0.15);
  EXPECT_NEAR(white, 2.0, 0.3);
}

TEST(RepeatedErrors, AreThoseOfTheMatchAndNotOfItsPose) {
  RepeatedErrors repeated;
  const Matrix2d own = 0.5 * Matrix2d::Identity();
  for (int i = 0; i < 1000; ++i) repeated.add(own, 100.0 * Matrix2d::Identity(), 1.0);
  EXPECT_NEAR(repeated.factor(), 1.005, 1e-6);
}

RepeatedErrors of_a_thousand() {
  RepeatedErrors repeated;
  for (int i = 0; i < 1000; ++i) repeated.add(Matrix2d::Identity(), Matrix2d::Identity(), 1.0);
  return repeated;
}

TEST(RepeatedErrors, FadeWithWhatTheyWereLearntIn) {
  RepeatedErrors repeated = of_a_thousand();
  ASSERT_NEAR(repeated.factor(), 2.0, 1e-6);
  repeated.fade(0.1, 0.0);
  EXPECT_NEAR(repeated.factor(), 2.0, 1e-6);
  repeated.fade(0.1, 0.01);  // by 1/40 of the variance
  EXPECT_NEAR(repeated.factor(), 1000 / 1.025 / kViews, 1e-6);
  repeated.fade(0.1, 1.0);
  EXPECT_EQ(repeated.factor(), 1.0);
  RepeatedErrors unknown = of_a_thousand();
  unknown.fade(0.0, 1.0);
  EXPECT_EQ(unknown.factor(), 1.0);
}

}  // namespace
}  // namespace perimap

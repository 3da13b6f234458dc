// core/calibration/turned_scope: an angled scope, put together here part by part.
#include "core/calibration/turned_scope.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

using testing::HasSubstr;

// The head H carries the sensor S; the scope's shaft lies along H's z axis and is turned about it by theta; at its end
// the objective looks 30 degrees aside. The camera's axes are those of the chip in the head, so that the picture of
// what the turned objective sees is turned back.
struct Built {
  Pose X_SH{so3_exp({0.2, -0.4, 0.7}), {12.0, -30.0, 25.0}};
  Pose X_HO{so3_exp(Vector3d(30.0 * kDegree, 0.0, 0.0)), Vector3d(0.5, -0.3, 310.0)};

  [[nodiscard]] SetupAtRotation at(double theta) const {
    const Pose turn{so3_exp(Vector3d(0.0, 0.0, theta)), Vector3d::Zero()};
    const Pose back{so3_exp(Vector3d(0.0, 0.0, -theta)), Vector3d::Zero()};
    const double x = 3.0 * std::cos(theta + 0.4), y = 3.0 * std::sin(theta + 0.4);
    return {theta, X_SH * turn * X_HO * back, Vector2d(320.0 + x, 240.0 + y)};
  }
};

TEST(TurnedScope, IsKnownAtTurnsThatNobodyMeasured) {
  const Built scope;
  const auto fitted = fit_turned_scope({scope.at(0.1), scope.at(1.2)}, Vector2d(320.0, 240.0));
  ASSERT_TRUE(fitted) << fitted.error().message;
  EXPECT_FALSE(fitted->sensor_on_scope);
  EXPECT_NEAR(fitted->axis_S.dot(scope.X_SH.R.col(2)), 1.0, 1e-9);
  for (const double theta : {-2.5, -0.4, 0.1, 0.7, 3.0}) {
    const SetupAtRotation truth = scope.at(theta);
    const SetupAtRotation told = fitted->at(theta);
    EXPECT_LT((told.X_SC.t - truth.X_SC.t).norm(), 1e-6) << theta;
    EXPECT_LT(so3_log(told.X_SC.R.transpose() * truth.X_SC.R).norm(), 1e-9) << theta;
    EXPECT_LT((told.principal_px - truth.principal_px).norm(), 1e-9) << theta;
  }
}

TEST(TurnedScope, PrincipalPointIsThatOfAllSetUps) {
  const Built scope;
  SetupAtRotation off = scope.at(0.1);
  off.principal_px += Vector2d(3.0, 0.0);
  const auto fitted = fit_turned_scope({off, scope.at(1.2), scope.at(2.5)}, Vector2d(320.0, 240.0));
  ASSERT_TRUE(fitted) << fitted.error().message;
  EXPECT_NEAR((fitted->at(0.7).principal_px - scope.at(0.7).principal_px).norm(), 1.0, 1e-9) << "a third of it";
}

TEST(TurnedScope, HalfATurnIsFittedTheRightWayRound) {
  const Built scope;
  SetupAtRotation half = scope.at(3.14);
  half.rotation_rad = -3.14;  // as the notch may say it
  const auto fitted = fit_turned_scope({scope.at(0.0), scope.at(1.5), half}, Vector2d(320.0, 240.0));
  ASSERT_TRUE(fitted) << fitted.error().message;
  EXPECT_GT(fitted->axis_S.dot(scope.X_SH.R.col(2)), 0.999);
  const auto alone = fit_turned_scope({scope.at(0.0), half}, Vector2d(320.0, 240.0));
  ASSERT_FALSE(alone);
  EXPECT_THAT(alone.error().message, HasSubstr("which way"));
}

TEST(TurnedScope, SensorOnTheScopeIsTold) {
  const Pose X_SO{so3_exp({0.1, 0.2, 0.3}), {1.0, 2.0, 80.0}};
  const auto at = [&](double theta) {
    return SetupAtRotation{theta, X_SO * Pose{so3_exp(Vector3d(0.0, 0.0, -theta)), Vector3d::Zero()}, {320.0, 240.0}};
  };
  const auto fitted = fit_turned_scope({at(0.0), at(0.9), at(-1.1)}, Vector2d(320.0, 240.0));
  ASSERT_TRUE(fitted) << fitted.error().message;
  EXPECT_TRUE(fitted->sensor_on_scope);
  EXPECT_LT((fitted->at(2.0).X_SC.R - at(2.0).X_SC.R).norm(), 1e-9);
  EXPECT_LT(fitted->translation_rms_mm, 1e-6);
}

TEST(TurnedScope, WhatIsMissingIsSaid) {
  const Built scope;
  EXPECT_THAT(fit_turned_scope({scope.at(0.1)}, Vector2d(320.0, 240.0)).error().message, HasSubstr("two turns"));
  EXPECT_THAT(fit_turned_scope({scope.at(0.1), scope.at(0.2)}, Vector2d(320.0, 240.0)).error().message,
              HasSubstr("20 degrees apart"));
  // As of a sensor that came loose: the picture turned by 0.5 rad more than the notch.
  SetupAtRotation other = scope.at(2.0);
  other.X_SC.R = other.X_SC.R * so3_exp({0.0, 0.0, 0.5});
  EXPECT_THAT(fit_turned_scope({scope.at(0.1), other}, Vector2d(320.0, 240.0)).error().message,
              HasSubstr("do not turn with the scope"));
}

// Set-ups that are off by their own deviations leave a function that is off by those that it tells.
TEST(TurnedScope, DeviationsAreThoseOfWhatIsTold) {
  const Built scope;
  std::mt19937 generator(4021);
  std::normal_distribution<double> normal;
  const auto normal3 = [&] { return Vector3d(normal(generator), normal(generator), normal(generator)); };
  constexpr double kRotation_rad = 0.1 * kDegree;
  constexpr double kTranslation_mm = 0.3;
  constexpr double kNotch_rad = 0.2 * kDegree;
  constexpr int kTrials = 300;
  constexpr int kTurns = 12;
  double rotation[kTurns]{};
  double translation[kTurns]{};
  double axis = 0.0;
  TurnedScope told;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<SetupAtRotation> setups;
    for (const double theta : {0.0, 1.2, 2.4}) {
      SetupAtRotation setup = scope.at(theta);
      setup.rotation_rad += kNotch_rad * normal(generator);
      setup.X_SC = setup.X_SC * Pose{so3_exp(kRotation_rad * normal3()), kTranslation_mm * normal3()};
      setup.rotation_deviation_rad = kNotch_rad;
      setup.covariance_C.diagonal() << Vector3d::Constant(kRotation_rad * kRotation_rad),
          Vector3d::Constant(kTranslation_mm * kTranslation_mm);
      setups.push_back(setup);
    }
    const auto fitted = fit_turned_scope(setups, Vector2d(320.0, 240.0));
    ASSERT_TRUE(fitted) << fitted.error().message;
    told = *fitted;
    axis += (fitted->axis_S - scope.X_SH.R.col(2)).squaredNorm() / kTrials;
    for (int i = 0; i < kTurns; ++i) {
      const double theta = kTwoPi * i / kTurns;
      const Pose error = scope.at(theta).X_SC.inverse() * fitted->at(theta).X_SC;
      rotation[i] += so3_log(error.R).squaredNorm() / kTrials;
      translation[i] += error.t.squaredNorm() / kTrials;
    }
  }
  EXPECT_NEAR(told.axis_deviation_rad / std::sqrt(axis), 1.0, 0.2);
  EXPECT_NEAR(told.rotation_deviation_rad / std::sqrt(*std::max_element(rotation, rotation + kTurns)), 1.0, 0.2);
  EXPECT_NEAR(told.translation_deviation_mm / std::sqrt(*std::max_element(translation, translation + kTurns)), 1.0,
              0.2);
}

// A principal point that is off turns the hand-eye that is measured through it: one error, and not two.
TEST(TurnedScope, ALensThatIsOffIsCountedOnceInATarget) {
  const Built scope;
  std::mt19937 generator(77);
  std::normal_distribution<double> normal;
  constexpr double kPoint_px = 2.0;
  constexpr double kFocal_px = 700.0;
  constexpr int kTrials = 400;
  constexpr int kTurns = 12;
  const Vector3d target_C(0.0, 0.0, TurnedScope::kTargetAhead_mm);
  Eigen::Matrix<double, 6, 2> turned_by = Eigen::Matrix<double, 6, 2>::Zero();  // rad for each px
  turned_by(1, 0) = 1.0 / kFocal_px;
  turned_by(0, 1) = -1.0 / kFocal_px;
  double squares[kTurns]{};
  TurnedScope told;
  TurnedScope as_two;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<SetupAtRotation> setups;
    for (const double theta : {0.0, 1.2, 2.4}) {
      SetupAtRotation setup = scope.at(theta);
      const Vector2d off_px(kPoint_px * normal(generator), kPoint_px * normal(generator));
      const Vector6d off = turned_by * off_px;
      setup.X_SC = setup.X_SC * Pose{so3_exp(off.head<3>()), off.tail<3>()};
      setup.principal_px += off_px;
      setup.focal_px = Vector2d::Constant(kFocal_px);
      setup.radius_px = 200.0;
      setup.principal_deviation_px = Vector2d::Constant(kPoint_px);
      setup.covariance_C = kPoint_px * kPoint_px * turned_by * turned_by.transpose();
      setup.covariance_with_principal = kPoint_px * kPoint_px * turned_by;
      setups.push_back(setup);
    }
    const auto fitted = fit_turned_scope(setups, Vector2d(320.0, 240.0));
    ASSERT_TRUE(fitted) << fitted.error().message;
    told = *fitted;
    for (int i = 0; i < kTurns; ++i) {
      const double theta = kTwoPi * i / kTurns;
      const SetupAtRotation truth = scope.at(theta);
      const SetupAtRotation at = fitted->at(theta);
      const Vector2d aside = (truth.principal_px - at.principal_px) / kFocal_px;
      const Vector3d seen_C = target_C.z() * Vector3d(aside.x(), aside.y(), 1.0);
      squares[i] += (at.X_SC * seen_C - truth.X_SC * target_C).squaredNorm() / kTrials;
    }
    for (SetupAtRotation& setup : setups) setup.covariance_with_principal.setZero();
    as_two = *fit_turned_scope(setups, Vector2d(320.0, 240.0));
  }
  EXPECT_NEAR(told.target_deviation_mm / std::sqrt(*std::max_element(squares, squares + kTurns)), 1.0, 0.15);
  EXPECT_NE(as_two.target_deviation_mm, told.target_deviation_mm);
  // Each by itself is as before.
  EXPECT_NEAR(as_two.rotation_deviation_rad, told.rotation_deviation_rad, 0.05 * told.rotation_deviation_rad);
  EXPECT_NEAR(as_two.principal_deviation_px, told.principal_deviation_px, 0.05 * told.principal_deviation_px);
}

}  // namespace
}  // namespace perimap

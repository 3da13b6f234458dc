// core/calibration/second_sensor, fit_by_second_sensor: a head and a scope with a sensor each, put together here.
#include "core/calibration/second_sensor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/calibration/fit_by_second_sensor.hpp"

namespace perimap {
namespace {

using testing::HasSubstr;

Pose turn_of(double theta) { return {so3_exp(Vector3d(0.0, 0.0, theta)), Vector3d::Zero()}; }

// The shaft lies along the head H's z axis, the scope O is turned about it by theta and looks 30 degrees aside. A
// sensor sits on each; the camera's axes are those of the chip in the head.
struct Built {
  Pose X_Hhead{so3_exp({0.2, -0.4, 0.7}), {12.0, -30.0, 25.0}};
  Pose X_Oscope{so3_exp({-0.9, 0.3, 0.1}), {-8.0, 14.0, 90.0}};
  Pose X_OL{so3_exp(Vector3d(30.0 * kDegree, 0.0, 0.0)), Vector3d(0.5, -0.3, 310.0)};
  bool sensor_on_scope = false;

  [[nodiscard]] Pose X_HS(double theta) const { return sensor_on_scope ? turn_of(theta) * X_Oscope : X_Hhead; }
  [[nodiscard]] Pose X_HS2(double theta) const { return sensor_on_scope ? X_Hhead : turn_of(theta) * X_Oscope; }
  [[nodiscard]] Matrix3d R_S2(double theta) const { return X_HS(theta).R.transpose() * X_HS2(theta).R; }
  [[nodiscard]] SetupAtRotation at(double theta) const {
    const double x = 9.0 * std::cos(theta + 0.4);
    const double y = 9.0 * std::sin(theta + 0.4);
    return {theta, X_HS(theta).inverse() * turn_of(theta) * X_OL * turn_of(-theta), Vector2d(318.0 + x, 243.0 + y)};
  }
};

std::vector<HeldRelation> relations(const Built& scope, const std::vector<double>& thetas) {
  std::vector<HeldRelation> held;
  for (const double theta : thetas) held.push_back({scope.R_S2(theta), 0.1 * kDegree, 0.1 * kDegree});
  return held;
}

std::vector<SetupAtRotation> setups(const Built& scope, const std::vector<double>& thetas) {
  std::vector<SetupAtRotation> made;
  for (const double theta : thetas) made.push_back(scope.at(theta));
  return made;
}

// Both sensors of a head that a hand swings, at 50 Hz, for so long; `slipping`: how the scope turns meanwhile, rad/s.
struct Recorded {
  std::vector<TimedPose> sensor;
  std::vector<TimedPose> second;
};
Recorded recorded(const Built& scope, double theta, double noise_rad, std::uint32_t seed, double seconds = 20.0,
                  double slipping = 0.0) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  const auto noise = [&] {
    return so3_exp(noise_rad * Vector3d(normal(generator), normal(generator), normal(generator)));
  };
  Recorded both;
  for (int i = 0; i < static_cast<int>(50.0 * seconds); ++i) {
    const double t = 0.02 * i;
    const double later = t + 0.004;
    const auto X_WH = [](double at) {
      return Pose{so3_exp(0.4 * Vector3d(std::sin(at), std::cos(0.7 * at), std::sin(0.4 * at))), {at, 0.0, -300.0}};
    };
    const Pose S = X_WH(t) * scope.X_HS(theta + slipping * t);
    const Pose S2 = X_WH(later) * scope.X_HS2(theta + slipping * later);
    both.sensor.push_back({t, {S.R * noise(), S.t}});
    both.second.push_back({later, {S2.R * noise(), S2.t}});
  }
  return both;
}

class ScopeBySecondSensor : public testing::TestWithParam<bool> {
 protected:
  Built scope_{.sensor_on_scope = GetParam()};
};

TEST_P(ScopeBySecondSensor, IsKnownAtTurnsThatNobodyMeasured) {
  const std::vector<double> thetas = {0.3, 1.5, 2.9};
  const auto fitted = fit_by_second_sensor(setups(scope_, thetas), relations(scope_, thetas));
  ASSERT_TRUE(fitted) << fitted.error().message;
  ASSERT_TRUE(fitted->second_sensor);
  EXPECT_EQ(fitted->sensor_on_scope, scope_.sensor_on_scope);
  EXPECT_LT(fitted->aside_translation_rms_mm, 1e-6);
  EXPECT_LT((fitted->turn_px - Vector2d(318.0, 243.0)).norm(), 1e-6) << "about which the principal point goes";
  for (const double theta : {-2.5, -0.4, 0.3, 0.9, 3.0}) {
    const double told = fitted->second_sensor->rotation_rad(scope_.R_S2(theta));
    const SetupAtRotation truth = scope_.at(theta);
    const SetupAtRotation setup = fitted->at(told);
    EXPECT_LT((setup.X_SC.t - truth.X_SC.t).norm(), 1e-5) << theta;
    EXPECT_LT(so3_log(setup.X_SC.R.transpose() * truth.X_SC.R).norm(), 1e-8) << theta;
    EXPECT_LT((setup.principal_px - truth.principal_px).norm(), 1e-6) << theta;
    EXPECT_LT(fitted->second_sensor->aside_rad(scope_.R_S2(theta)), 1e-8);
  }
}

TEST_P(ScopeBySecondSensor, TellsWhichWayRoundAStraightScopesPrincipalPointGoes) {
  // Its hand-eye fits either way round: which one better is the measurements' errors' doing.
  scope_.X_OL = {Matrix3d::Identity(), Vector3d(0.0, 0.0, 310.0)};
  std::mt19937 generator(78125);
  std::normal_distribution<double> off_rad(0.0, 0.1 * kDegree);
  for (int trial = 0; trial < 20; ++trial) {
    const std::vector<double> thetas =
        trial % 2 == 0 ? std::vector<double>{0.3, 1.5, 2.9} : std::vector<double>{2.9, 1.5, 0.3};
    auto measured = setups(scope_, thetas);
    for (SetupAtRotation& setup : measured) {
      const double x = off_rad(generator);
      const double y = off_rad(generator);
      setup.X_SC.R = setup.X_SC.R * so3_exp(Vector3d(x, y, 0.0));
    }
    const auto fitted = fit_by_second_sensor(measured, relations(scope_, thetas));
    ASSERT_TRUE(fitted) << fitted.error().message;
    for (const double theta : {-2.5, 0.9}) {
      const double told = fitted->second_sensor->rotation_rad(scope_.R_S2(theta));
      EXPECT_LT((fitted->at(told).principal_px - scope_.at(theta).principal_px).norm(), 1e-6) << theta;
    }
  }
}

TEST_P(ScopeBySecondSensor, WhatIsMissingIsSaid) {
  const auto error = [](const Expected<TurnedScope>& fitted) { return fitted ? "" : fitted.error().message; };
  const std::vector<double> two = {0.1, 1.5};
  EXPECT_THAT(error(fit_by_second_sensor(setups(scope_, two), relations(scope_, two))), HasSubstr("three turns"));
  const std::vector<double> thetas = {0.1, 1.5, 2.7};
  EXPECT_THAT(error(fit_by_second_sensor(setups(scope_, thetas), relations(scope_, {0.1, 0.11, 0.12}))),
              HasSubstr("on the camera head and the other one on the scope"));
  auto loose = relations(scope_, thetas);
  loose[1].R_S2 = loose[1].R_S2 * so3_exp({0.15, -0.1, 0.0});
  EXPECT_THAT(error(fit_by_second_sensor(setups(scope_, thetas), loose)), HasSubstr("about one axis"));
  // A tool that turns, but not with the scope.
  EXPECT_THAT(error(fit_by_second_sensor(setups(scope_, thetas), relations(scope_, {0.1, 0.8, 1.2}))),
              HasSubstr("do not turn with the scope"));
}

INSTANTIATE_TEST_SUITE_P(SensorOnHeadAndOnScope, ScopeBySecondSensor, testing::Bool());

TEST(SecondSensor, HowFarItIsAsideOfItsTurnsIsTold) {
  const Built scope;
  const SecondSensor second{scope.R_S2(0.0), scope.X_Hhead.R.transpose().col(2), 0.0};
  const Vector3d across = second.axis_S.unitOrthogonal();
  const Matrix3d slipped = so3_exp(0.05 * across) * scope.R_S2(1.1);
  EXPECT_NEAR(second.rotation_rad(slipped), 1.1, 1e-3);
  EXPECT_NEAR(second.aside_rad(slipped), 0.05, 1e-3);
}

TEST(HeldRelation, DeviationIsThatOfItsMean) {
  const Built scope;
  constexpr int kTrials = 60;
  double nees = 0.0;
  for (std::uint32_t trial = 0; trial < kTrials; ++trial) {
    const Recorded both = recorded(scope, 0.8, 0.3 * kDegree, 7100 + trial);
    const auto held = held_relation(both.sensor, both.second);
    ASSERT_TRUE(held) << held.error().message;
    const double off_rad = so3_log(scope.R_S2(0.8).transpose() * held->R_S2).norm();
    EXPECT_LT(off_rad, 0.1 * kDegree);
    nees += off_rad * off_rad / (3.0 * held->deviation_rad * held->deviation_rad) / kTrials;
  }
  EXPECT_GT(nees, 0.7);
  EXPECT_LT(nees, 1.4);
}

TEST(HeldRelation, WhatIsMissingIsSaid) {
  const Built scope;
  const Recorded both = recorded(scope, 0.8, 0.0, 1);
  EXPECT_THAT(held_relation(both.sensor, {}).error().message, HasSubstr("seen together for 0 seconds"));
  EXPECT_THAT(held_relation({both.sensor.begin(), both.sensor.begin() + 100}, both.second).error().message,
              HasSubstr("five and more"));
  const Recorded slipping = recorded(scope, 0.8, 0.0, 1, 20.0, 0.02);
  EXPECT_THAT(held_relation(slipping.sensor, slipping.second).error().message, HasSubstr("turned in its camera head"));
}

}  // namespace
}  // namespace perimap

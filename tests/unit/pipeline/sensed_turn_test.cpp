// core/pipeline/sensed_turn: two sensors whose poses are made here, one on the camera head and one on the scope.
#include "core/pipeline/sensed_turn.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>

#include "angled_scope.hpp"
#include "core/angle/angle.hpp"
#include "counted_allocations.hpp"

namespace perimap {
namespace {

constexpr double kNoise_rad = 0.2 * kDegree;  // per axis

TurnedScope angled() {
  TurnedScope scope = test::angled_scope();
  scope.second_sensor = SecondSensor{so3_exp({-0.7, 0.4, 0.3}), scope.axis_S, 0.0};
  return scope;
}

PoseHistorySettings tracker() {
  PoseHistorySettings settings;
  settings.rotation_deviation_rad = kNoise_rad;
  return settings;
}

// A hundred readings a second of both, thirty frames.
class TwoSensors : public testing::Test {
 protected:
  // Until then, since the start.
  void run(Duration until, double turn_rad, const Matrix3d& slip = Matrix3d::Identity()) {
    for (; now_ < until; now_ += std::chrono::milliseconds(10)) {
      const double t = to_seconds(now_);
      TrackerSample sample;
      sample.source_time = Instant(now_) + std::chrono::seconds(1);
      sample.arrival = sample.source_time + std::chrono::milliseconds(8);
      sample.state = ToolState::kOk;
      const Matrix3d R_WS = so3_exp(0.3 * Vector3d(std::sin(t), std::cos(0.8 * t), std::sin(0.5 * t)));
      sample.X_WS = {R_WS * noise(), {t, 2.0, -300.0}};
      turn_.add(sample);
      const SecondSensor& second = *scope_.second_sensor;
      sample.X_WS.R = R_WS * slip * so3_exp(turn_rad * second.axis_S) * second.reference_S2 * noise();
      if (stuck_) sample.X_WS = *stuck_;
      if (!seen_) sample.state = ToolState::kMissing;
      turn_.add_second(sample);
      last_second_ = sample.X_WS;
      if (now_ % frame_every_ != Duration(0)) continue;
      state_ = turn_.at(sample.source_time - std::chrono::milliseconds(4));
      told_ += state_ ? 1 : 0;
      ++frames_;
    }
  }
  Matrix3d noise() {
    return so3_exp(kNoise_rad * Vector3d(normal_(generator_), normal_(generator_), normal_(generator_)));
  }

  TurnedScope scope_ = angled();
  SensedTurn turn_{scope_, test::angled_lens(), tracker()};
  std::mt19937 generator_{5077};
  std::normal_distribution<double> normal_;
  Duration now_{0};
  Duration frame_every_ = std::chrono::milliseconds(10);
  std::optional<ScopeState> state_;
  Pose last_second_;
  std::optional<Pose> stuck_;
  bool seen_ = true;
  int told_ = 0;
  int frames_ = 0;
};

// The state is a mean of what was told lately, and lags behind a scope that is being turned.
TEST_F(TwoSensors, WhileTheScopeIsTurnedTheStateIsOffByNoMoreThanItSays) {
  frame_every_ = std::chrono::milliseconds(30);
  for (const double rate : {1.0, 3.0, 5.0, 15.0, 25.0}) {
    double turn_rad = 0.6;
    run(now_ + std::chrono::seconds(2), turn_rad);
    int told = 0, beyond = 0;
    double squares = 0.0;
    for (const Duration until = now_ + std::chrono::seconds(2); now_ < until;) {
      turn_rad += rate * kDegree * 0.01;
      const int frames = frames_;
      run(now_ + std::chrono::milliseconds(10), turn_rad);
      if (frames_ == frames || !state_) continue;
      ++told;
      const double off = std::remainder(state_->rotation_rad - turn_rad, kTwoPi) / state_->rotation_deviation_rad;
      squares += off * off;
      beyond += std::abs(off) > 4.0 ? 1 : 0;
    }
    EXPECT_LE(beyond, 1 + told / 20) << rate << " degrees a second, of " << told;
    EXPECT_LT(squares, 4.0 * told + 20.0) << rate << " degrees a second, of " << told;
  }
}

TEST_F(TwoSensors, EachFrameHasTheSetUpOfItsTurn) {
  run(std::chrono::seconds(1), 0.6);
  ASSERT_TRUE(state_);
  EXPECT_NEAR(state_->rotation_rad, 0.6, 4.0 * state_->rotation_deviation_rad);
  EXPECT_LT(state_->rotation_deviation_rad, 0.2 * kDegree);
  EXPECT_LT((state_->X_SC.t - scope_.at(0.6).X_SC.t).norm(), 0.3);
  EXPECT_GT(told_, 95);
  run(std::chrono::seconds(2), 1.4);
  ASSERT_TRUE(state_);
  EXPECT_NEAR(state_->rotation_rad, 1.4, 4.0 * state_->rotation_deviation_rad);
  EXPECT_EQ(turn_.turns(), 1U);
  const Vector2d told = state_->picture.to_picture(Vector2d(test::angled_lens().cx, test::angled_lens().cy));
  EXPECT_LT((told - scope_.at(1.4).principal_px).norm(), 0.2) << "and the principal point with it";
}

TEST_F(TwoSensors, AFrameWithoutEitherIsToldNothing) {
  run(std::chrono::seconds(1), 0.6);
  seen_ = false;
  run(std::chrono::milliseconds(1010), 0.6);
  told_ = 0;
  run(std::chrono::milliseconds(1500), 0.6);
  EXPECT_EQ(told_, 0) << "never the last turn";
  seen_ = true;
  run(std::chrono::milliseconds(2000), 1.4);
  ASSERT_TRUE(state_);
  EXPECT_NEAR(state_->rotation_rad, 1.4, 4.0 * state_->rotation_deviation_rad);
}

TEST_F(TwoSensors, ASensorThatHasSlippedTellsNothing) {
  run(std::chrono::seconds(1), 0.6);
  const Vector3d across = scope_.axis_S.unitOrthogonal();
  told_ = 0;
  run(std::chrono::seconds(2), 0.6, so3_exp(8.0 * kDegree * across));
  EXPECT_LE(told_, 5) << "while the window still holds what was before";
}

TEST_F(TwoSensors, ASecondSensorThatRepeatsItselfIsNotSeen) {
  run(std::chrono::seconds(1), 0.6);
  EXPECT_FALSE(turn_.take_stuck_since());
  stuck_ = last_second_;
  run(std::chrono::milliseconds(1600), 0.6);
  EXPECT_FALSE(state_);
  const auto since = turn_.take_stuck_since();
  ASSERT_TRUE(since);
  EXPECT_NEAR(to_seconds(since->time_since_epoch()), 2.0, 0.03) << "from when its readings were no longer new";
  EXPECT_FALSE(turn_.take_stuck_since()) << "told once";
}

TEST_F(TwoSensors, TakesNoMemory) {
  run(std::chrono::seconds(1), 0.6);
  EXPECT_EQ(test::allocations_of([&] { run(std::chrono::seconds(2), 0.9); }), 0);
}

}  // namespace
}  // namespace perimap

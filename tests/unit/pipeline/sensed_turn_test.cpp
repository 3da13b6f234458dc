// core/pipeline/sensed_turn: two sensors whose poses are made here, one on the camera head and one on the scope.
#include "core/pipeline/sensed_turn.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "angled_scope.hpp"
#include "core/angle/angle.hpp"
#include "counted_allocations.hpp"

namespace perimap {
namespace {

constexpr double kNoise_rad = 0.2 * kDegree;  // per axis
constexpr Duration kReadingEvery = std::chrono::milliseconds(10);

TurnedScope angled() {
  TurnedScope scope = test::angled_scope();
  scope.second_sensor = SecondSensor{so3_exp({-0.7, 0.4, 0.3}), scope.axis_S, 0.0};
  return scope;
}

PoseHistorySettings tracker(Duration error_lasts = Duration(0)) {
  PoseHistorySettings settings;
  settings.rotation_deviation_rad = kNoise_rad;
  settings.error_correlation = error_lasts;
  return settings;
}

// Of one sensor, per axis: new in each reading, or first-order Markov with a correlation time.
class OrientationError {
 public:
  explicit OrientationError(Duration lasts)
      : kept_(lasts > Duration(0) ? std::exp(-to_seconds(kReadingEvery) / to_seconds(lasts)) : 0.0) {}
  Matrix3d next(std::mt19937& generator) {
    const double share = begun_ ? kept_ : 0.0;
    begun_ = true;
    const auto drawn = [&] { return kNoise_rad * normal_(generator); };
    error_rad_ = share * error_rad_ + std::sqrt(1.0 - share * share) * Vector3d(drawn(), drawn(), drawn());
    return so3_exp(error_rad_);
  }

 private:
  double kept_;
  bool begun_ = false;
  std::normal_distribution<double> normal_;
  Vector3d error_rad_ = Vector3d::Zero();
};

// A hundred readings a second of both, thirty frames.
class TwoSensors : public testing::Test {
 protected:
  // Until then, since the start.
  void run(Duration until, double turn_rad, const Matrix3d& slip = Matrix3d::Identity()) {
    for (; now_ < until; now_ += kReadingEvery) {
      const double t = to_seconds(now_);
      TrackerSample sample;
      sample.source_time = Instant(now_) + std::chrono::seconds(1);
      sample.arrival = sample.source_time + std::chrono::milliseconds(8);
      sample.state = ToolState::kOk;
      const Matrix3d R_WS = so3_exp(0.3 * Vector3d(std::sin(t), std::cos(0.8 * t), std::sin(0.5 * t)));
      sample.X_WS = {R_WS * error_.next(generator_), {t, 2.0, -300.0}};
      turn_->add(sample);
      const SecondSensor& second = *scope_.second_sensor;
      sample.X_WS.R =
          R_WS * slip * so3_exp(turn_rad * second.axis_S) * second.reference_S2 * second_error_.next(generator_);
      if (stuck_) sample.X_WS = *stuck_;
      if (!seen_) sample.state = ToolState::kMissing;
      turn_->add_second(sample);
      last_second_ = sample.X_WS;
      if (now_ % frame_every_ != Duration(0)) continue;
      state_ = turn_->at(sample.source_time - std::chrono::milliseconds(4));
      told_ += state_ ? 1 : 0;
      ++frames_;
    }
  }
  // Anew, with a tracker whose errors last so long, and which says that they last `told`.
  void begin_anew(Duration lasts, Duration told) {
    turn_.emplace(scope_, test::angled_lens(), tracker(told));
    error_ = OrientationError(lasts);
    second_error_ = OrientationError(lasts);
    now_ = Duration(0);
    state_.reset();
  }

  TurnedScope scope_ = angled();
  std::optional<SensedTurn> turn_{std::in_place, scope_, test::angled_lens(), tracker()};
  std::mt19937 generator_{5077};
  OrientationError error_{Duration(0)};
  OrientationError second_error_{Duration(0)};
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
  constexpr int kTrials = 20;
  for (const double rate : {1.0, 3.0, 5.0, 15.0, 25.0}) {
    int told = 0, beyond = 0;
    double squares = 0.0, farthest_rad = 0.0;
    for (int trial = 0; trial < kTrials; ++trial) {
      begin_anew(Duration(0), Duration(0));
      double turn_rad = 0.6;
      run(std::chrono::seconds(2), turn_rad);
      for (const Duration until = now_ + std::chrono::seconds(2); now_ < until;) {
        turn_rad += rate * kDegree * 0.01;
        const int frames = frames_;
        run(now_ + kReadingEvery, turn_rad);
        if (frames_ == frames || !state_) continue;
        ++told;
        const double off_rad = std::remainder(state_->rotation_rad - turn_rad, kTwoPi);
        const double off = off_rad / state_->rotation_deviation_rad;
        farthest_rad = std::max(farthest_rad, std::abs(off_rad));
        squares += off * off;
        beyond += std::abs(off) > 4.0 ? 1 : 0;
      }
    }
    // Turned so fast, hardly a frame is told anything: the first one or two of the turn, and not much else than before.
    constexpr int kFrames = kTrials * 66;
    if (told < kFrames / 10) {
      EXPECT_LT(farthest_rad, 2.5 * kDegree) << rate << " degrees a second, of " << told;
      continue;
    }
    EXPECT_LE(beyond, kTrials + told / 20) << rate << " degrees a second, of " << told;
    EXPECT_LT(squares, 4.0 * told + 20.0 * kTrials) << rate << " degrees a second, of " << told;
  }
}

// A mean over a window takes from an error what does not outlast the window, and no more.
TEST_F(TwoSensors, OfATrackerWhoseErrorsLastTheStateIsOffByAsMuchAsItSays) {
  const auto squares_by_variance = [&](Duration lasts, Duration told) {
    constexpr int kTrials = 200;
    double sum = 0.0;
    for (int trial = 0; trial < kTrials; ++trial) {
      begin_anew(lasts, told);
      run(std::chrono::milliseconds(600), 0.6);
      if (!state_) return 0.0;
      const double off = (state_->rotation_rad - 0.6) / state_->rotation_deviation_rad;
      sum += off * off / kTrials;
    }
    return sum;
  };
  // While it is held the deviation is too large, by the lag that it can not exclude.
  for (const auto lasts :
       {std::chrono::milliseconds(50), std::chrono::milliseconds(300), std::chrono::milliseconds(2000)}) {
    const double told = squares_by_variance(lasts, lasts);
    EXPECT_GT(told, 0.3) << lasts.count() << " ms";
    EXPECT_LT(told, 1.3) << lasts.count() << " ms";
  }
  EXPECT_GT(squares_by_variance(std::chrono::seconds(2), Duration(0)), 3.0) << "untold it is too small";
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
  EXPECT_EQ(turn_->turns(), 1U);
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
  EXPECT_FALSE(turn_->take_stuck_since());
  stuck_ = last_second_;
  run(std::chrono::milliseconds(1600), 0.6);
  EXPECT_FALSE(state_);
  const auto since = turn_->take_stuck_since();
  ASSERT_TRUE(since);
  EXPECT_NEAR(to_seconds(since->time_since_epoch()), 2.0, 0.03) << "from when its readings were no longer new";
  EXPECT_FALSE(turn_->take_stuck_since()) << "told once";
}

TEST_F(TwoSensors, TakesNoMemory) {
  run(std::chrono::seconds(1), 0.6);
  EXPECT_EQ(test::allocations_of([&] { run(std::chrono::seconds(2), 0.9); }), 0);
}

}  // namespace
}  // namespace perimap

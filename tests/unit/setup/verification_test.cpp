// daemon/setup: what a set-up's verification finds, and what it says that it cannot see.
#include "daemon/setup/verification.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>
#include <string>
#include <vector>

namespace perimap {
namespace {

using testing::HasSubstr;

struct Watched {
  std::vector<TimedPose> camera;
  std::vector<TimedPose> sensor;
  std::vector<TimedPose> exact;  // without noise
  TouchOnTrial touch;
  SetupOnTrial truth;
};

constexpr double kNoise_mm = 0.4;

// Of the tracker, per axis.
struct Noise {
  double position_mm = kNoise_mm;
  double rotation_rad = 0.0;
  unsigned seed = 11;
};

Watched watched(double turn = 0.4, double speed = 1.0, const Noise& noise = {}) {
  std::mt19937 generator(noise.seed);
  std::normal_distribution<double> normal;
  Watched w;
  w.truth = {{so3_exp({0.1, -0.2, 1.5}), {10.0, -5.0, 60.0}}, 0.02};
  const Pose X_WB{so3_exp({0.3, 1.0, -0.4}), {100.0, 20.0, -900.0}};
  for (int i = 0; i < 1500; ++i) {
    const double t = 0.01 * i;
    const double u = speed * t;
    const Pose X_BC{so3_exp(turn * Vector3d(std::sin(1.3 * u), std::sin(1.9 * u + 1.0), std::sin(0.9 * u + 2.0))),
                    {20.0 * std::sin(u), 10.0 * std::cos(1.7 * u), -150.0}};
    Pose X_WS = X_WB * X_BC * w.truth.X_SC.inverse();
    const auto normal3 = [&] { return Vector3d(normal(generator), normal(generator), normal(generator)); };
    w.exact.push_back({t - w.truth.time_offset_s, X_WS});
    X_WS.t += noise.position_mm * normal3();
    if (noise.rotation_rad > 0.0) X_WS.R = X_WS.R * so3_exp(noise.rotation_rad * normal3());
    if (i % 7 == 0) w.camera.push_back({t, X_BC});
    w.sensor.push_back({t - w.truth.time_offset_s, X_WS});
    w.touch.tip_W.push_back(
        {t, X_WB.t + kNoise_mm * Vector3d(normal(generator), normal(generator), normal(generator))});
  }
  return w;
}

const Vector3d kMiddle_B(40.0, 30.0, 0.0);

TEST(Verification, OfARightSetupPasses) {
  const Watched w = watched();
  const auto result = verify_setup(w.camera, w.sensor, kMiddle_B, w.truth, w.touch, 1.0);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_TRUE(result->passed()) << text_of(*result);
  EXPECT_LT(result->error_mm, 0.4);
  EXPECT_LT(result->touch->error_mm, 0.3);
  EXPECT_NEAR(result->scatter_mm, kNoise_mm * std::sqrt(3.0), 0.1);
}

TEST(Verification, OfAWrongSetupFails) {
  const Watched w = watched();
  const auto fails = [&](const SetupOnTrial& setup) {
    const auto result = verify_setup(w.camera, w.sensor, kMiddle_B, setup, w.touch, 1.0);
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_FALSE(result->passed()) << text_of(*result);
  };
  SetupOnTrial wrong = w.truth;
  wrong.X_SC.t.x() += 8.0;
  fails(wrong);
  wrong = w.truth;
  wrong.X_SC.R = wrong.X_SC.R * so3_exp({0.03, 0.0, 0.0});
  fails(wrong);
  wrong = w.truth;
  wrong.time_offset_s += 0.05;
  fails(wrong);
}

TEST(Verification, OfATimeOffsetFailsAndSaysHowFarItIsOffHoweverFastTheScopeIsSwung) {
  // About 0.3, 1 and 1.5 Hz.
  for (const double speed : {1.3, 4.5, 6.5}) {
    const Watched w = watched(0.35, speed);
    const auto right = verify_setup(w.camera, w.sensor, kMiddle_B, w.truth, {}, 1.0);
    ASSERT_TRUE(right) << right.error().message;
    EXPECT_TRUE(right->passed()) << speed << ": " << text_of(*right);
    for (const double offset_s : {-0.02, -0.01, 0.01, 0.02}) {
      SetupOnTrial wrong = w.truth;
      wrong.time_offset_s += offset_s;
      const auto result = verify_setup(w.camera, w.sensor, kMiddle_B, wrong, {}, 1.0);
      ASSERT_TRUE(result) << result.error().message;
      EXPECT_FALSE(result->passed()) << speed << ", " << offset_s << ": " << text_of(*result);
      EXPECT_FALSE(result->clock_passed()) << speed << ", " << offset_s << ": " << text_of(*result);
      EXPECT_NEAR(result->clock_error_ms, -1e3 * offset_s, 1.5) << speed << ": " << text_of(*result);
    }
  }
}

TEST(Verification, OfAScopeSwungTooSlowlyToTellTheClocksFails) {
  const Watched w = watched(0.35, 0.15, {0.8, 0.02, 3});
  const auto result = verify_setup(w.camera, w.sensor, kMiddle_B, w.truth, {}, 1.0);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_FALSE(result->clock_passed()) << text_of(*result);
  EXPECT_LT(std::abs(result->clock_error_ms), 3.0 * result->clock_error_ms_deviation);
}

// The deviations that are told are those of what is told: of the clocks, and of the error in mm.
TEST(Verification, DeviationsAreTrue) {
  constexpr int kTrials = 50;  // of each kind
  constexpr double kShare = 1.0 / (4.0 * kTrials);
  double clocks = 0.0;
  double covered = 0.0;
  double above = 0.0;
  unsigned seed = 1000;
  for (const double offset_s : {0.0, 0.015}) {
    for (const double speed : {1.3, 4.5}) {
      for (int trial = 0; trial < kTrials; ++trial) {
        const Watched w = watched(0.35, speed, {0.8, 0.005, ++seed});
        SetupOnTrial setup = w.truth;
        setup.time_offset_s += offset_s;
        const auto result = verify_setup(w.camera, w.sensor, kMiddle_B, setup, {}, 2.0);
        ASSERT_TRUE(result) << result.error().message;
        const double off_ms = result->clock_error_ms + 1e3 * offset_s;
        clocks += kShare * std::pow(off_ms / result->clock_error_ms_deviation, 2.0);
        // Of poses without noise, what is off is all there is.
        const auto exact = verify_setup(w.camera, w.exact, kMiddle_B, setup, {}, 2.0);
        ASSERT_TRUE(exact) << exact.error().message;
        covered += exact->scatter_mm <= result->error_mm + 2.0 * result->error_mm_deviation ? kShare : 0.0;
        above += exact->scatter_mm < result->error_mm - 3.0 * result->error_mm_deviation ? kShare : 0.0;
      }
    }
  }
  EXPECT_GT(clocks, 0.7);  // of 200 trials, 0.80 to 1.20 by chance (95 %)
  EXPECT_LT(clocks, 1.2);
  EXPECT_GT(covered, 0.93);
  EXPECT_LT(above, 0.1);
}

TEST(Verification, OfASensorThatSlipsOnTheScopeFails) {
  for (const double share : {0.6, 0.8, 0.95}) {
    Watched w = watched();
    const auto from = static_cast<std::size_t>(share * static_cast<double>(w.sensor.size()));
    for (std::size_t i = from; i < w.sensor.size(); ++i) {
      w.sensor[i].X = w.sensor[i].X * Pose{Matrix3d::Identity(), Vector3d(12.0, 0.0, 0.0)};
    }
    const auto result = verify_setup(w.camera, w.sensor, kMiddle_B, w.truth, {}, 1.0);
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_FALSE(result->passed()) << share << ": " << text_of(*result);
    EXPECT_EQ(result->views_left_out, 0U);
  }
}

TEST(Verification, OfAFewViewsThatAreWrongAltogetherPassesAndSaysSo) {
  Watched w = watched();
  for (const std::size_t i : {20U, 90U, 150U}) w.camera[i].X.t += Vector3d(60.0, 0.0, 0.0);
  const auto result = verify_setup(w.camera, w.sensor, kMiddle_B, w.truth, {}, 1.0);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_TRUE(result->passed()) << text_of(*result);
  EXPECT_EQ(result->views_left_out, 3U);
}

TEST(Verification, WhatIsWrongAlikeFromAllSidesShowsByTheTouchedPoint) {
  Watched w = watched();
  for (TimedPoint& point : w.touch.tip_W) point.p += Vector3d(0.0, 3.0, 0.0);
  const auto result = verify_setup(w.camera, w.sensor, kMiddle_B, w.truth, w.touch, 1.0);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_TRUE(result->board_passed());
  EXPECT_FALSE(result->touch_passed());
  EXPECT_NEAR(result->touch->error_mm, 3.0, 0.3);
}

TEST(Verification, WithoutATouchedPointSaysHowMuchItCanNotSee) {
  const Watched w = watched();
  const auto right = verify_setup(w.camera, w.sensor, kMiddle_B, w.truth, {}, 2.0);
  ASSERT_TRUE(right) << right.error().message;
  const double unseen_mm = right->unseen_mm;
  EXPECT_GT(unseen_mm, 3.0) << "more than the bound";
  EXPECT_LT(unseen_mm, 20.0);
  EXPECT_THAT(text_of(*right), HasSubstr("--tip"));
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  int passed = 0;
  for (int trial = 0; trial < 30; ++trial) {
    const Vector3d towards = Vector3d(normal(generator), normal(generator), normal(generator)).normalized();
    SetupOnTrial wrong = w.truth;
    wrong.X_SC.t += 1.2 * unseen_mm * towards;
    const auto far = verify_setup(w.camera, w.sensor, kMiddle_B, wrong, {}, 2.0);
    ASSERT_TRUE(far) << far.error().message;
    EXPECT_FALSE(far->board_passed()) << text_of(*far);
    EXPECT_EQ(far->unseen_mm, 0.0);
    wrong.X_SC.t = w.truth.X_SC.t + 3.0 * towards;
    const auto near = verify_setup(w.camera, w.sensor, kMiddle_B, wrong, {}, 2.0);
    ASSERT_TRUE(near) << near.error().message;
    passed += near->board_passed() ? 1 : 0;
    const auto touched = verify_setup(w.camera, w.sensor, kMiddle_B, wrong, w.touch, 2.0);
    ASSERT_TRUE(touched) << touched.error().message;
    EXPECT_FALSE(touched->touch_passed()) << text_of(*touched);
  }
  EXPECT_GT(passed, 0) << "or there would be nothing to say";
}

TEST(Verification, WhatIsMissingIsSaid) {
  const Watched w = watched();
  const auto refusal = [&](const Watched& of, const std::optional<TouchOnTrial>& touch) {
    const auto result = verify_setup(of.camera, of.sensor, kMiddle_B, of.truth, touch, 1.0);
    return result ? std::string("accepted") : result.error().message;
  };
  Watched few = w;
  few.camera.resize(10);
  EXPECT_THAT(refusal(few, {}), HasSubstr("keep board and sensor in sight"));
  EXPECT_THAT(refusal(watched(0.02), {}), HasSubstr("swing it about the board"));
  TouchOnTrial elsewhere = w.touch;
  elsewhere.touched_B = Vector3d(90.0, 0.0, 0.0);
  EXPECT_THAT(refusal(w, elsewhere), HasSubstr("--touched"));
  TouchOnTrial moving = w.touch;
  for (std::size_t i = 0; i < moving.tip_W.size(); ++i) moving.tip_W[i].p.x() += static_cast<double>(i);
  EXPECT_THAT(refusal(w, moving), HasSubstr("held still nowhere"));
}

}  // namespace
}  // namespace perimap

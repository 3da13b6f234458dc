// How well a lens is known: in its file, and in the hand-eye that is measured through it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "daemon/setup/lens_in_hand_eye.hpp"
#include "daemon/setup/setup_report.hpp"
#include "drivers/calibration/calibration_file.hpp"
#include "drivers/calibration/lens_covariance.hpp"

namespace perimap {
namespace {

CameraModel lens() {
  CameraModel camera;
  camera.width = 1280, camera.height = 720;
  camera.fx = camera.fy = 1000.0, camera.cx = 640.0, camera.cy = 360.0;
  camera.k1 = -0.2;
  return camera;
}

LensCovariance point_covariance(double px) {
  LensCovariance covariance = LensCovariance::Zero();
  covariance(2, 2) = px * px;
  return covariance;
}

TEST(LensCovariance, IsReadAsItIsWrittenBesideTheLens) {
  LensCovariance covariance = point_covariance(1.5);
  covariance(0, 0) = 4.0;
  covariance(0, 2) = covariance(2, 0) = -1.25e-3;
  const std::string text = format_calibration(lens()) + format_lens_covariance(covariance);
  const auto read = parse_lens_covariance(text);
  ASSERT_TRUE(read);
  EXPECT_EQ(*read, covariance);
  const auto camera = parse_calibration(text, "camera.yaml");
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_EQ(camera->cx, 640.0);
}

TEST(LensCovariance, ThatIsNoneIsNotTaken) {
  EXPECT_FALSE(parse_lens_covariance(format_calibration(lens())));
  EXPECT_FALSE(parse_lens_covariance("lens_covariance: 3\n"));
  EXPECT_FALSE(parse_lens_covariance("lens_covariance: { data: [ 1, 2 ] }\n"));
  EXPECT_FALSE(parse_lens_covariance("lens_covariance: {{{"));
  LensCovariance negative = point_covariance(1.0);
  negative(0, 0) = -1.0;
  EXPECT_FALSE(parse_lens_covariance(format_lens_covariance(negative)));
  LensCovariance beyond_one = point_covariance(1.0);
  beyond_one(3, 3) = 1.0;
  beyond_one(2, 3) = beyond_one(3, 2) = 1.1;
  EXPECT_FALSE(parse_lens_covariance(format_lens_covariance(beyond_one)));
  LensCovariance no_number = point_covariance(1.0);
  no_number(5, 5) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(parse_lens_covariance(format_lens_covariance(no_number)));
}

TEST(LensCovariance, SurvivesGarbledBytes) {
  std::mt19937 generator(1);
  const std::string sound = format_calibration(lens()) + format_lens_covariance(point_covariance(1.0));
  for (int trial = 0; trial < 500; ++trial) {
    std::string text = sound;
    for (int k = 0; k < 1 + trial % 5; ++k) text[generator() % text.size()] = static_cast<char>(generator());
    const auto read = parse_lens_covariance(text);
    EXPECT_TRUE(!read || read->allFinite());
  }
}

struct Swung {
  std::vector<TimedView> views;
  std::vector<TimedPose> sensor;
};

// Before a board of 9x6 corners, without noise of the corners.
Swung swung() {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal(0.0, 0.1);
  const Pose X_SC{so3_exp({0.1, -0.2, 1.5}), {10.0, -5.0, 200.0}};
  const Pose X_WB{so3_exp({0.3, 1.0, -0.4}), {100.0, 20.0, -900.0}};
  Swung motion;
  for (int i = 0; i < 600; ++i) {
    const double t = i / 15.0;
    const Vector3d w(0.4 * std::sin(1.3 * t) + 0.1 * std::sin(4.1 * t), 0.4 * std::sin(1.9 * t + 1.0),
                     0.6 * std::sin(0.9 * t + 2.0));
    const Vector3d middle(32.0, 20.0, 0.0);
    const Pose look{so3_exp({std::numbers::pi, 0.0, 0.0}), {10.0 * std::sin(t), 8.0 * std::cos(1.7 * t), 110.0}};
    const Pose X_BC = Pose{so3_exp(w), middle} * look;
    TimedView seen{t + 0.2, {}};
    for (int y = 0; y < 6; ++y) {
      for (int x = 0; x < 9; ++x) {
        const Vector3d p_B(8.0 * x, 8.0 * y, 0.0);
        Vector2d px;
        if (lens().project(X_BC.inverse() * p_B, px) != ProjectionStatus::kOk) continue;
        seen.view.board_mm.push_back(p_B);
        seen.view.px.push_back(px);
      }
    }
    motion.views.push_back(seen);
    Pose X_WS = X_WB * X_BC * X_SC.inverse();
    X_WS.t += Vector3d(normal(generator), normal(generator), normal(generator));
    motion.sensor.push_back({t, X_WS});
  }
  return motion;
}

TEST(LensInHandEye, APrincipalPointThatIsOpenTurnsTheHandEyeAndHardlyMovesWhatIsSeen) {
  const Swung motion = swung();
  auto result = calibrate_hand_eye(camera_poses_of(motion.views, lens()), motion.sensor, {});
  ASSERT_TRUE(result) << result.error().message;
  const auto alone = result->covariance;
  const double target_alone_mm = result->target_deviation_mm();
  constexpr double kPoint_px = 4.0;
  add_lens_uncertainty(*result, motion.views, lens(), point_covariance(kPoint_px));
  ASSERT_TRUE(result->covariance_by_lens);
  // About the picture's y axis, by the angle of the pixels that the point may be off.
  const double turned_rad = kPoint_px / 1000.0;
  EXPECT_NEAR(std::sqrt((*result->covariance_by_lens)(1, 1)), turned_rad, 0.2 * turned_rad);
  EXPECT_LT(std::sqrt((*result->covariance_by_lens)(0, 0)), 0.2 * turned_rad);
  EXPECT_LT((result->covariance - alone - *result->covariance_by_lens).norm(), 1e-12);
  // What is 90 mm ahead would be off by that angle, did the hand-eye not go with the lens.
  EXPECT_LT(result->target_deviation_by_lens_mm, 0.5 * 90.0 * turned_rad);
  EXPECT_GE(result->target_deviation_mm(), target_alone_mm);
}

TEST(LensInHandEye, WhatCanNotBeWorkedOutIsSaidWithItsReason) {
  const Swung motion = swung();
  auto result = calibrate_hand_eye(camera_poses_of(motion.views, lens()), motion.sensor, {});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_THAT(text_of(*result), testing::HasSubstr("how well it is known was not told"));
  const auto alone = result->covariance;
  // Two views determine no hand-eye.
  add_lens_uncertainty(*result, {motion.views[0], motion.views[20]}, lens(), point_covariance(1.0));
  EXPECT_FALSE(result->covariance_by_lens);
  EXPECT_EQ(result->covariance, alone);
  EXPECT_THAT(text_of(*result), testing::HasSubstr("two of its views a second do not determine the hand-eye"));
  EXPECT_THAT(json_of(*result)["lens_is_taken_for_exact_because"].get<std::string>(),
              testing::HasSubstr("do not determine"));
}

TEST(LensInHandEye, ALensThatIsKnownAddsNothing) {
  const Swung motion = swung();
  auto result = calibrate_hand_eye(camera_poses_of(motion.views, lens()), motion.sensor, {});
  ASSERT_TRUE(result) << result.error().message;
  const auto alone = result->covariance;
  add_lens_uncertainty(*result, motion.views, lens(), LensCovariance::Zero());
  ASSERT_TRUE(result->covariance_by_lens);
  EXPECT_EQ(result->covariance, alone);
}

}  // namespace
}  // namespace perimap

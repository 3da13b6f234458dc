#include "core/pipeline/pose_history.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace perimap {
namespace {

using std::chrono::milliseconds;

Instant at_ms(int ms) { return Instant(milliseconds(1000 + ms)); }

TrackerSample reading(int ms, double x_mm, ToolState state = ToolState::kOk) {
  TrackerSample sample;
  sample.source_time = at_ms(ms);
  sample.state = state;
  sample.X_WS.t = Vector3d(x_mm, 0.0, 0.0);
  return sample;
}

PoseHistorySettings noisy() {
  PoseHistorySettings settings;
  settings.position_deviation_mm = 1.0;
  return settings;
}

TEST(PoseHistory, HasNoPoseBeforeTwoReadings) {
  PoseHistory history({});
  EXPECT_FALSE(history.at(at_ms(0)).valid());
  ASSERT_TRUE(history.add(reading(0, 1.0)));
  EXPECT_FALSE(history.at(at_ms(0)).valid());
}

TEST(PoseHistory, InterpolatesBetweenReadingsAndNeverGivesTheLatest) {
  PoseHistory history({});
  ASSERT_TRUE(history.add(reading(0, 0.0)));
  ASSERT_TRUE(history.add(reading(10, 10.0)));
  ASSERT_TRUE(history.add(reading(20, 30.0)));
  const CameraPose pose = history.at(at_ms(15));
  EXPECT_EQ(pose.state, CameraPose::State::kInterpolated);
  EXPECT_NEAR(pose.X_WC.t.x(), 20.0, 1e-12);
}

TEST(PoseHistory, DoesNotInterpolateAcrossAMissingTool) {
  PoseHistory history({});
  ASSERT_TRUE(history.add(reading(0, 0.0)));
  ASSERT_TRUE(history.add(reading(10, 0.0, ToolState::kMissing)));
  ASSERT_TRUE(history.add(reading(20, 20.0)));
  ASSERT_TRUE(history.add(reading(30, 30.0)));
  EXPECT_FALSE(history.at(at_ms(5)).valid());
  EXPECT_FALSE(history.at(at_ms(15)).valid());
  EXPECT_TRUE(history.at(at_ms(25)).valid());
}

TEST(PoseHistory, DoesNotInterpolateAcrossAGapInTheStamps) {
  PoseHistory history({});
  ASSERT_TRUE(history.add(reading(0, 0.0)));
  ASSERT_TRUE(history.add(reading(60, 60.0)));
  EXPECT_FALSE(history.at(at_ms(30)).valid());
}

TEST(PoseHistory, ExtrapolatesAtMostTheSettingWithGrownVariance) {
  PoseHistory history(noisy());
  ASSERT_TRUE(history.add(reading(0, 0.0)));
  ASSERT_TRUE(history.add(reading(10, 10.0)));
  const CameraPose inside = history.at(at_ms(5));
  const CameraPose near = history.at(at_ms(15));
  const CameraPose far = history.at(at_ms(30));
  EXPECT_EQ(near.state, CameraPose::State::kExtrapolated);
  EXPECT_NEAR(near.X_WC.t.x(), 15.0, 1e-9);
  EXPECT_GT(near.position_variance_mm2, inside.position_variance_mm2);
  EXPECT_GT(far.position_variance_mm2, near.position_variance_mm2);
  EXPECT_FALSE(history.at(at_ms(31)).valid());
}

TEST(PoseHistory, NeverExtrapolatesFromAMissingTool) {
  PoseHistory history({});
  ASSERT_TRUE(history.add(reading(0, 0.0)));
  ASSERT_TRUE(history.add(reading(10, 10.0)));
  ASSERT_TRUE(history.add(reading(20, 0.0, ToolState::kOutOfVolume)));
  EXPECT_TRUE(history.reached(at_ms(20)));
  EXPECT_FALSE(history.at(at_ms(25)).valid());
}

TEST(PoseHistory, RefusesReadingsThatGoBackOrAreNotFinite) {
  PoseHistory history({});
  ASSERT_TRUE(history.add(reading(10, 0.0)));
  EXPECT_FALSE(history.add(reading(10, 1.0)));
  EXPECT_FALSE(history.add(reading(5, 1.0)));
  EXPECT_FALSE(history.add(reading(20, std::numeric_limits<double>::quiet_NaN())));
}

TEST(PoseHistory, AppliesHandEyeAndTimeOffset) {
  PoseHistorySettings settings;
  settings.X_SC.t = Vector3d(0.0, 0.0, 100.0);
  settings.time_offset = milliseconds(4);
  PoseHistory history(settings);
  ASSERT_TRUE(history.add(reading(0, 0.0)));
  ASSERT_TRUE(history.add(reading(10, 10.0)));
  const CameraPose pose = history.at(at_ms(9));
  EXPECT_NEAR(pose.X_WC.t.x(), 5.0, 1e-9);
  EXPECT_NEAR(pose.X_WC.t.z(), 100.0, 1e-9);
  EXPECT_NEAR(pose.lever_W_mm.z(), 100.0, 1e-9);
}

TEST(PoseHistory, HalfWayBetweenTwoReadingsHasHalfTheirVariance) {
  PoseHistory history(noisy());
  ASSERT_TRUE(history.add(reading(0, 0.0)));
  ASSERT_TRUE(history.add(reading(10, 10.0)));
  EXPECT_NEAR(history.at(at_ms(5)).position_variance_mm2, 0.5, 0.001);
}

TEST(PoseHistory, ASlowErrorDoesNotAverageOutBetweenTwoReadings) {
  PoseHistorySettings settings = noisy();
  settings.error_correlation = std::chrono::seconds(5);
  PoseHistory history(settings);
  ASSERT_TRUE(history.add(reading(0, 0.0)));
  ASSERT_TRUE(history.add(reading(10, 10.0)));
  EXPECT_NEAR(history.at(at_ms(5)).position_variance_mm2, 0.5 + 0.5 * std::exp(-0.002), 0.001);
}

}  // namespace
}  // namespace perimap

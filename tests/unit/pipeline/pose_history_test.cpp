#include "core/pipeline/pose_history.hpp"

#include <gtest/gtest.h>

#include <cmath>
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

// Where the device's own figure is what the configuration says anyway, nothing changes.
TEST(PoseHistory, APoseIsAtLeastAsUncertainAsTheDeviceSaysItIs) {
  PoseHistorySettings settings = noisy();  // 1 mm an axis
  settings.rotation_deviation_rad = 0.01;
  const auto at_middle = [&settings](double before_mm, double after_mm) {
    PoseHistory history(settings);
    TrackerSample first = reading(0, 0.0);
    TrackerSample second = reading(10, 10.0);
    first.error_mm = before_mm;
    second.error_mm = after_mm;
    EXPECT_TRUE(history.add(first) && history.add(second));
    return history.at(at_ms(5));
  };
  const CameraPose usual = at_middle(0.0, 0.0);
  const CameraPose good = at_middle(1.7, 0.2);
  EXPECT_EQ(good.position_variance_mm2, usual.position_variance_mm2);
  EXPECT_EQ(good.rotation_variance_rad2, usual.rotation_variance_rad2);
  EXPECT_EQ(at_middle(std::numeric_limits<double>::quiet_NaN(), 0.0).position_variance_mm2,
            usual.position_variance_mm2);
  const double twice_mm = 2.0 * std::sqrt(3.0);  // RMS of the norm: 2 mm an axis
  const CameraPose bad = at_middle(twice_mm, twice_mm);
  EXPECT_NEAR(bad.position_variance_mm2 / usual.position_variance_mm2, 4.0, 0.01);
  EXPECT_NEAR(bad.rotation_variance_rad2 / usual.rotation_variance_rad2, 4.0, 0.01);
  const CameraPose half = at_middle(twice_mm, 0.0);
  EXPECT_NEAR(half.position_variance_mm2 / usual.position_variance_mm2, (4.0 + 1.0) / 2.0, 0.01);
}

// Between the readings and beyond them, whether their errors last or not.
TEST(PoseHistory, AnErrorThatTheDeviceTellsNeverMakesAPoseBetter) {
  for (const double correlation_s : {0.0, 0.005, 0.1, 10.0, 1e6}) {
    PoseHistorySettings settings = noisy();
    settings.rotation_deviation_rad = 0.01;
    settings.error_correlation = from_seconds(correlation_s);
    settings.maximum_extrapolation = milliseconds(20);
    for (const double before_mm : {0.0, 2.0, 3.5, 5.2, 20.0}) {
      for (const double after_mm : {0.0, 2.0, 3.5, 5.2, 20.0}) {
        PoseHistory usual(settings);
        PoseHistory told(settings);
        TrackerSample first = reading(0, 0.0);
        TrackerSample second = reading(10, 10.0);
        ASSERT_TRUE(usual.add(first) && usual.add(second));
        first.error_mm = before_mm;
        second.error_mm = after_mm;
        ASSERT_TRUE(told.add(first) && told.add(second));
        for (int ms = 0; ms <= 30; ++ms) {
          ASSERT_GE(told.at(at_ms(ms)).position_variance_mm2, usual.at(at_ms(ms)).position_variance_mm2)
              << ms << " ms, " << before_mm << " and " << after_mm << " mm, " << correlation_s << " s";
          ASSERT_GE(told.at(at_ms(ms)).rotation_variance_rad2, usual.at(at_ms(ms)).rotation_variance_rad2);
        }
      }
    }
  }
}

TEST(PoseHistory, ATrackerThatIsSaidToBeExactIsAsFarOffAsItSays) {
  PoseHistory history({});
  TrackerSample first = reading(0, 0.0);
  TrackerSample second = reading(10, 10.0);
  first.error_mm = second.error_mm = 0.3 * std::sqrt(3.0);
  ASSERT_TRUE(history.add(first) && history.add(second));
  EXPECT_NEAR(history.at(at_ms(10)).position_variance_mm2, 0.09, 1e-3);
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

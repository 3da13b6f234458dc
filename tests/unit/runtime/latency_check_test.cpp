#include "daemon/runtime/latency_check.hpp"

#include <gtest/gtest.h>

namespace perimap {
namespace {

using std::chrono::milliseconds;

TEST(LatencyCheck, TellsWhenFramesArriveTooLateForTheBudgetBeforeTheRelease) {
  PipelineSettings settings;
  settings.latency = milliseconds(50);
  settings.budget = milliseconds(12);
  PipelineCounters early;
  PipelineCounters late;
  for (int frame = 0; frame < 100; ++frame) {
    EXPECT_FALSE(frame < 59 && check_latency(settings, late).told) << "too few frames to tell";
    early.camera_delay.add(milliseconds(30));
    // Two in a hundred are enough: each makes an update late.
    late.camera_delay.add(milliseconds(frame % 50 == 0 ? 45 : 30));
    for (PipelineCounters* counters : {&early, &late}) {
      counters->tracker_delay.add(milliseconds(10));
      counters->tracker_interval.add(milliseconds(10));
    }
  }
  ASSERT_TRUE(check_latency(settings, early).told);
  EXPECT_FALSE(check_latency(settings, early).too_short);
  EXPECT_TRUE(check_latency(settings, late).too_short);
  EXPECT_GE(check_latency(settings, late).arrival, milliseconds(40));
}

// A frame is mapped when the tracker has told of its capture, which the first reading after it does.
TEST(LatencyCheck, TellsWhenThePoseOfAFrameArrivesTooLateThoughTheFrameDoesNot) {
  PipelineSettings settings;
  settings.latency = milliseconds(50);
  settings.budget = milliseconds(12);
  const auto checked = [&settings](Duration interval, Duration delay) {
    PipelineCounters counters;
    for (int i = 0; i < 100; ++i) {
      counters.camera_delay.add(milliseconds(10));
      counters.tracker_delay.add(delay);
      counters.tracker_interval.add(interval);
    }
    return check_latency(settings, counters);
  };
  EXPECT_FALSE(checked(milliseconds(10), milliseconds(20)).too_short);
  EXPECT_TRUE(checked(milliseconds(10), milliseconds(35)).too_short) << "a slow tracker";
  const LatencyCheck rare = checked(milliseconds(25), milliseconds(20));
  EXPECT_TRUE(rare.too_short) << "one whose readings are far apart";
  EXPECT_TRUE(rare.by_pose);
  EXPECT_GE(rare.arrival, milliseconds(42));
  settings.pose.time_offset = milliseconds(10);
  EXPECT_FALSE(checked(milliseconds(25), milliseconds(20)).too_short) << "its stamps are early";
}

TEST(LatencyCheck, WaitsForTheTracker) {
  PipelineSettings settings;
  settings.latency = milliseconds(50);
  settings.budget = milliseconds(12);
  PipelineCounters counters;
  for (int i = 0; i < 100; ++i) counters.camera_delay.add(milliseconds(10));
  EXPECT_FALSE(check_latency(settings, counters).told);
  for (int i = 0; i < 100; ++i) counters.camera_delay.add(milliseconds(45));
  EXPECT_TRUE(check_latency(settings, counters).too_short) << "frames tell by themselves";
}

}  // namespace
}  // namespace perimap

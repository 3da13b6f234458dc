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
  }
  ASSERT_TRUE(check_latency(settings, early).told);
  EXPECT_FALSE(check_latency(settings, early).too_short);
  EXPECT_TRUE(check_latency(settings, late).too_short);
  EXPECT_GE(check_latency(settings, late).arrival, milliseconds(40));
}

}  // namespace
}  // namespace perimap

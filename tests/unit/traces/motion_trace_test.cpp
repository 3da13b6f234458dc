#include "drivers/standins/trace/motion_trace.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>

namespace perimap {
namespace {

TEST(MotionTrace, PointsAreNamedByTheHeadingAndTheRateIsThatOfTheTimes) {
  const auto trace = parse_motion_trace(
      "t_s,POI_x,POI_y,POI_z,AP1_x,AP1_y,AP1_z\n1,1,2,3,4,5,6\n1.05,2,3,4,5,6,7\n1.1,1,1,1,2,2,2\n", "m.csv");
  ASSERT_TRUE(trace) << trace.error().message;
  EXPECT_EQ(trace->points, (std::vector<std::string>{"POI", "AP1"}));
  EXPECT_NEAR(trace->period_s, 0.05, 1e-12);
  EXPECT_EQ(trace->first_s, 1.0);
  ASSERT_EQ(trace->samples(), 3);
  EXPECT_EQ(trace->positions(1, 3), 5.0);
}

TEST(MotionTrace, WithoutAHeadingPointsAreNumbers) {
  const auto trace = parse_motion_trace("0 1 2 3\n0.04 1 2 3\n", "m.csv");
  ASSERT_TRUE(trace) << trace.error().message;
  EXPECT_EQ(trace->points, std::vector<std::string>{"1"});
}

TEST(MotionTrace, WhatIsNoTraceIsRefusedByFileAndLine) {
  const std::pair<const char*, const char*> refused[] = {
      {"", "m.csv"},
      {"t,x,y,z\n", "m.csv"},
      {"t,x,y,z\n0,1,2,3\n", "one a line"},
      {"0,1,2\n0.04,1,2\n", "3 columns"},
      {"0,1,2,3,4\n0.04,1,2,3,4\n", "5 columns"},
      {"0,1,2,3\n0.04,1,nan,3\n0.08,1,2,3\n", "m.csv:2: column 3"},
      {"0,1,2,3\n0.04,1,,3\n0.08,1,2,3\n", "m.csv:2"},
      {"0,1,2,3\n0.04,1,2,3\n0.2,1,2,3\n0.24,1,2,3\n", "samples are missing"},
      {"0,1,2,3\n0,1,2,3\n", "m.csv"},
      {"1,1,2,3\n0,1,2,3\n", "m.csv"},
      {"0,1,2,3\n0.04,1,2\n", "m.csv:2"},
  };
  for (const auto& [text, what] : refused) {
    const auto trace = parse_motion_trace(text, "m.csv");
    ASSERT_FALSE(trace) << text;
    EXPECT_NE(trace.error().message.find(what), std::string::npos) << trace.error().message;
    EXPECT_EQ(trace.error().message.find('\n'), std::string::npos);
  }
}

TEST(RPeaks, AreTimesThatGrow) {
  const auto peaks = parse_r_peaks("0.5\n1.4\n2.2\n", "r.txt");
  ASSERT_TRUE(peaks) << peaks.error().message;
  EXPECT_EQ(peaks->size(), 3U);
  for (const char* text : {"0.5\n0.4\n", "1\n1\n", "0.5,1\n0.9,2\n", "nan\n1\n"}) {
    EXPECT_FALSE(parse_r_peaks(text, "r.txt")) << text;
  }
}

}  // namespace
}  // namespace perimap

#include "daemon/evaluation/tool/tool_figures.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace perimap {
namespace {

constexpr std::int64_t kMs = 1'000'000;

// Touches from 20 to 21 s and from 25 to 26 s, comes and goes at 20 mm/s, and is 10 mm away else.
double true_distance(double t_s) {
  double least = 10.0;
  for (const double begin : {20.0, 25.0}) {
    const double before = std::max({0.0, begin - t_s, t_s - (begin + 1.0)});
    least = std::min(least, 20.0 * before);
  }
  return least;
}

std::vector<perimap_TruthTool> truth() {
  std::vector<perimap_TruthTool> all;
  for (int ms = 0; ms <= 30'000; ms += 10) {
    perimap_TruthTool one{};
    one.time_ns = ms * kMs;
    one.distance_mm = true_distance(1e-3 * ms);
    one.touches = one.distance_mm == 0.0;
    all.push_back(one);
  }
  return all;
}

// At 50 Hz; `error_mm` at all horizons, each with a deviation of 0.5 mm.
ToolFigures judged(double error_mm, double says_so_at_mm = 0.0) {
  const auto truths = truth();
  ToolTally tally(truths);
  for (int ms = 5; ms < 29'000; ms += 20) {
    perimap_ToolDistance sample{};
    sample.time_ns = ms * kMs;
    sample.state = perimap_TOOL_GOOD;
    const double ahead_s[] = {0.0, 0.1, 0.3};
    for (std::size_t h = 0; h < 3; ++h) {
      sample.states[h] = perimap_TOOL_GOOD;
      sample.distances_mm[h] = true_distance(1e-3 * ms + ahead_s[h]) + error_mm;
      sample.deviations_mm[h] = 0.5;
    }
    sample.touches = true_distance(1e-3 * ms) <= says_so_at_mm;
    tally.add(sample);
  }
  return tally.figures();
}

TEST(ToolFigures, AreTheErrorsAtEachHorizonAndWhatTheDeviationsMakeOfThem) {
  const ToolFigures figures = judged(0.5);
  for (const ToolFigures::Errors& errors : figures.horizons) {
    EXPECT_NEAR(*errors.rms_mm, 0.5, 0.01);
    EXPECT_NEAR(*errors.p95_mm, 0.5, 0.02);
    EXPECT_NEAR(*errors.nees, 1.0, 0.05);
  }
  EXPECT_EQ(figures.samples, figures.usable);
  EXPECT_LT(figures.near.samples, figures.horizons[0].samples);
}

TEST(ToolFigures, ATouchIsToldWithinAFrameOrSomeBefore) {
  const ToolFigures exact = judged(0.0);
  EXPECT_EQ(exact.touches, 2U);
  EXPECT_EQ(exact.touches_told, 2U);
  EXPECT_GE(*exact.told_frames_median, 0.0);
  EXPECT_LE(*exact.told_frames_worst, 1.0);
  EXPECT_GT(*exact.told_share, 0.97);
  EXPECT_EQ(*exact.false_share, 0.0);
  // 2 mm before is a tenth of a second at 20 mm/s.
  EXPECT_NEAR(*judged(0.0, 2.0).told_frames_median, -5.0, 1.0);
}

TEST(ToolFigures, ATouchThatIsNeverSaidIsNotTold) {
  const ToolFigures never = judged(0.0, -1.0);
  EXPECT_EQ(never.touches, 2U);
  EXPECT_EQ(never.touches_told, 0U);
  EXPECT_FALSE(never.told_frames_median);
}

TEST(ToolFigures, WhatIsInvalidIsNotCounted) {
  const auto truths = truth();
  ToolTally tally(truths);
  perimap_ToolDistance sample{};
  sample.time_ns = 20'100 * kMs;
  sample.distances_mm[0] = std::nan("");
  tally.add(sample);
  const ToolFigures figures = tally.figures();
  EXPECT_EQ(figures.samples, 1U);
  EXPECT_EQ(figures.usable, 0U);
  EXPECT_FALSE(figures.horizons[0].rms_mm);
  EXPECT_TRUE(to_json(figures)["distance_rms_mm"].is_null());
}

}  // namespace
}  // namespace perimap

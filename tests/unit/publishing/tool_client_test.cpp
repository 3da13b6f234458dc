#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "made_tool.hpp"
#include "perimap_tool_client.hpp"

namespace perimap::client {
namespace {

using test::made_tool;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kTime = 5'000 * kMs;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

ToolAtInstant at(const perimap_ToolDistance& tool, std::int64_t ahead_ns) {
  return distance_at(tool, kTime + ahead_ns, kTime + 10 * kMs);
}

void expect_refused(const ToolAtInstant& tool, ToolRefusal why) {
  EXPECT_EQ(tool.refusal, why);
  EXPECT_EQ(tool.state, perimap_TOOL_INVALID);
  EXPECT_TRUE(std::isnan(tool.distance_mm) && std::isnan(tool.deviation_mm) && std::isnan(tool.rate_mm_per_s));
  EXPECT_FALSE(tool.touches);
  EXPECT_STRNE(describe(tool), "known");
}

TEST(ToolClient, AtTheSamplesOwnInstantsItIsAsTold) {
  const perimap_ToolDistance tool = made_tool(kTime);
  const std::int64_t ahead[] = {0, 100 * kMs, 300 * kMs};
  for (std::size_t h = 0; h < 3; ++h) {
    const ToolAtInstant told = at(tool, ahead[h]);
    ASSERT_EQ(told.refusal, ToolRefusal::kNone) << describe(told);
    EXPECT_EQ(told.state, perimap_TOOL_GOOD);
    EXPECT_EQ(told.distance_mm, tool.distances_mm[h]);
    EXPECT_EQ(told.deviation_mm, tool.deviations_mm[h]);
    EXPECT_EQ(told.rate_mm_per_s, tool.rates_mm_per_s[h]);
  }
}

// A cubic of the time is met to the last digits, and its rate is its slope.
TEST(ToolClient, BetweenThemItGoesOnAsItsDistancesAndRatesSay) {
  const auto distance = [](double s) { return 4.0 - 20.0 * s + 30.0 * s * s + 100.0 * s * s * s; };
  const auto rate = [](double s) { return -20.0 + 60.0 * s + 300.0 * s * s; };
  perimap_ToolDistance tool = made_tool(kTime);
  const double horizons_s[] = {0.0, 0.1, 0.3};
  for (std::size_t h = 0; h < 3; ++h) {
    tool.distances_mm[h] = distance(horizons_s[h]);
    tool.rates_mm_per_s[h] = rate(horizons_s[h]);
    tool.deviations_mm[h] = 0.5 + static_cast<double>(h);
  }
  for (const std::int64_t ms : {1, 16, 33, 99, 101, 150, 299}) {
    const ToolAtInstant told = at(tool, ms * kMs);
    const double s = 1e-3 * static_cast<double>(ms);
    EXPECT_NEAR(told.distance_mm, distance(s), 1e-12) << ms;
    EXPECT_NEAR(told.rate_mm_per_s, rate(s), 1e-10) << ms;
    EXPECT_GT(told.deviation_mm, ms < 100 ? 0.5 : 1.5) << ms;
    EXPECT_LT(told.deviation_mm, ms < 100 ? 1.5 : 2.5) << ms;
  }
}

TEST(ToolClient, ATouchIsOneOfTheInstantAskedFor) {
  perimap_ToolDistance tool = made_tool(kTime);
  for (std::size_t h = 0; h < 3; ++h) tool.rates_mm_per_s[h] = -20.0;
  tool.distances_mm[0] = 2.0;
  tool.distances_mm[1] = 0.0;
  tool.distances_mm[2] = -4.0;
  EXPECT_FALSE(at(tool, 0).touches);
  EXPECT_FALSE(at(tool, 74 * kMs).touches);  // 0.52 mm
  EXPECT_TRUE(at(tool, 76 * kMs).touches);   // 0.48 mm
}

TEST(ToolClient, TheWorseStateOfTheInstantsBesideItHolds) {
  perimap_ToolDistance tool = made_tool(kTime);
  tool.states[1] = perimap_TOOL_DEGRADED;
  tool.reasons[1] = perimap_TOOL_REASON_SURFACE;
  EXPECT_EQ(at(tool, 0).state, perimap_TOOL_GOOD);
  for (const std::int64_t ms : {1, 100, 299}) EXPECT_EQ(at(tool, ms * kMs).state, perimap_TOOL_DEGRADED) << ms;
  EXPECT_STREQ(describe(at(tool, kMs)), "the surface is not good");
  tool.states[2] = perimap_TOOL_INVALID;
  tool.reasons[2] = perimap_TOOL_REASON_BEYOND_EDGE;
  tool.distances_mm[2] = kNone;
  EXPECT_EQ(at(tool, 100 * kMs).refusal, ToolRefusal::kNone);
  expect_refused(at(tool, 101 * kMs), ToolRefusal::kPublisher);
  EXPECT_STREQ(describe(at(tool, 101 * kMs)), "beside what is known of the surface");
  tool.reasons[2] = perimap_TOOL_REASON_NONE;
  expect_refused(at(tool, 101 * kMs), ToolRefusal::kPublisher);
}

TEST(ToolClient, OnlyTheTimesItWasToldForAreAnswered) {
  const perimap_ToolDistance tool = made_tool(kTime);
  expect_refused(at(tool, -1), ToolRefusal::kOtherTime);
  expect_refused(at(tool, 300 * kMs + 1), ToolRefusal::kOtherTime);
  expect_refused(at(tool, std::numeric_limits<std::int64_t>::max() - kTime), ToolRefusal::kOtherTime);
  expect_refused(distance_at(tool, std::numeric_limits<std::int64_t>::min(), kTime), ToolRefusal::kOtherTime);
  EXPECT_EQ(distance_at(tool, kTime, tool.valid_until_ns).refusal, ToolRefusal::kNone);
  expect_refused(distance_at(tool, kTime, tool.valid_until_ns + 1), ToolRefusal::kStale);
}

TEST(ToolClient, NumbersThatNoPerimapdSendsAreRefused) {
  for (const double wrong :
       {kNone, std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()}) {
    for (const auto member : {&perimap_ToolDistance::distances_mm, &perimap_ToolDistance::deviations_mm,
                              &perimap_ToolDistance::rates_mm_per_s}) {
      perimap_ToolDistance tool = made_tool(kTime);
      (tool.*member)[1] = wrong;
      EXPECT_EQ(at(tool, 0).refusal, ToolRefusal::kNone);
      expect_refused(at(tool, kMs), ToolRefusal::kMalformed);
    }
  }
  perimap_ToolDistance tool = made_tool(kTime);
  tool.deviations_mm[0] = -0.1;
  expect_refused(at(tool, 0), ToolRefusal::kMalformed);
  tool = made_tool(kTime);
  tool.states[2] = 3;  // nothing of it is used, be it beside another instant
  expect_refused(at(tool, 0), ToolRefusal::kMalformed);
  EXPECT_FALSE(at(tool, 0).tip_known);
  tool = made_tool(kTime);
  tool.distances_mm[0] = std::numeric_limits<double>::max();
  tool.distances_mm[1] = -std::numeric_limits<double>::max();
  expect_refused(at(tool, 50 * kMs), ToolRefusal::kMalformed);
}

TEST(ToolClient, TheTipIsToldWhateverTheSurfaceIs) {
  perimap_ToolDistance tool = made_tool(kTime);
  tool.tip_velocity_W_mm_per_s[1] = 100.0;
  for (std::size_t h = 0; h < 3; ++h) {
    tool.states[h] = perimap_TOOL_INVALID;
    tool.reasons[h] = perimap_TOOL_REASON_NO_SURFACE;
  }
  const ToolAtInstant told = at(tool, 50 * kMs);
  expect_refused(told, ToolRefusal::kPublisher);
  ASSERT_TRUE(told.tip_known);
  EXPECT_DOUBLE_EQ(told.tip_W_mm[1], tool.tip_W_mm[1] + 5.0);
  tool.tip_W_mm[0] = kNone;
  EXPECT_FALSE(at(tool, 0).tip_known);
  tool = made_tool(kTime);
  tool.tip_known = false;
  EXPECT_FALSE(at(tool, 0).tip_known);
}

}  // namespace
}  // namespace perimap::client

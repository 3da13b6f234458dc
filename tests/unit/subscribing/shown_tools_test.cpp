#include "daemon/subscribing/shown_tools.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "daemon/subscribing/shown_surface.hpp"
#include "made_publication.hpp"
#include "made_tool.hpp"

namespace perimap {
namespace {

using namespace std::chrono_literals;
using test::made_tool;
using test::MadePublication;
using testing::ElementsAre;

const Instant kNow = from_ns(0) + 100'350ms;

std::vector<std::string> names(const std::vector<ShownTool>& tools) {
  std::vector<std::string> names;
  for (const ShownTool& tool : tools) names.push_back(tool.name);
  return names;
}

TEST(ShownTools, EachIsToldForTheInstantOfTheSurface) {
  ShownTools tools;
  tools.take(made_tool(to_ns(kNow), "pointer"));
  tools.take(made_tool(to_ns(kNow), "instrument/probe"));
  tools.take(made_tool(to_ns(kNow + 33ms), "instrument/probe", 2));
  const auto shown = tools.at(kNow + 50ms, kNow + 50ms, perimap_SURFACE_GOOD);
  ASSERT_THAT(names(shown), ElementsAre("instrument/probe", "pointer"));
  EXPECT_NEAR(shown[0].at.distance_mm, 3.0 - 10.0 * 0.017, 1e-9);  // by its newer sample
  EXPECT_NEAR(shown[1].at.distance_mm, 3.0 - 10.0 * 0.050, 1e-9);
  ASSERT_TRUE(shown[0].nearest_W_mm);
  EXPECT_NEAR((*shown[0].nearest_W_mm)[2], 97.0 + shown[0].at.distance_mm, 1e-9);
}

TEST(ShownTools, BesideASurfaceThatMayNotBeUsedNothingButTheNameIsTold) {
  ShownTools tools;
  tools.take(made_tool(to_ns(kNow)));
  const auto shown = tools.at(kNow, kNow, perimap_SURFACE_INVALID);
  ASSERT_EQ(shown.size(), 1U);
  EXPECT_EQ(shown[0].at.state, perimap_TOOL_INVALID);
  EXPECT_FALSE(shown[0].at.tip_known);
  EXPECT_FALSE(shown[0].nearest_W_mm);
  EXPECT_STREQ(client::describe(shown[0].at), "the surface is not good");
}

TEST(ShownTools, NoDistanceIsWorthMoreThanTheSurfaceBesideIt) {
  ShownTools tools;
  tools.take(made_tool(to_ns(kNow)));
  EXPECT_EQ(tools.at(kNow, kNow, perimap_SURFACE_GOOD)[0].at.state, perimap_TOOL_GOOD);
  const auto shown = tools.at(kNow, kNow, perimap_SURFACE_DEGRADED);
  EXPECT_EQ(shown[0].at.state, perimap_TOOL_DEGRADED);
  EXPECT_EQ(shown[0].at.distance_mm, 3.0);
  EXPECT_STREQ(client::describe(shown[0].at), "the surface is not good");
}

TEST(ShownTools, OneThatIsTooOldSaysSoForAWhileAndGoesThen) {
  ShownTools tools;
  tools.take(made_tool(to_ns(kNow)));
  const auto late = tools.at(kNow + 5s, kNow + 5s, perimap_SURFACE_GOOD);
  ASSERT_EQ(late.size(), 1U);
  EXPECT_EQ(late[0].at.refusal, client::ToolRefusal::kStale);
  EXPECT_FALSE(late[0].at.tip_known);
  EXPECT_TRUE(tools.at(kNow + 11s, kNow + 11s, perimap_SURFACE_GOOD).empty());
}

TEST(ShownTools, NamesWithoutEndTakeNoMemory) {
  ShownTools tools;
  for (int i = 0; i < 1000; ++i) tools.take(made_tool(to_ns(kNow) + i, "instrument/" + std::to_string(i)));
  const auto shown = names(tools.at(kNow, kNow, perimap_SURFACE_GOOD));
  EXPECT_EQ(shown.size(), ShownTools::kMost);
  EXPECT_THAT(shown, testing::Contains("instrument/999"));
}

TEST(ShownTools, ASurfaceHasThemThroughTheGate) {
  MadePublication made;
  SurfaceGate gate;
  gate.take(made_tool(to_ns(kNow)));
  ShownSurface shown = gate.show(made.surface_at(kNow + 20ms, 7), kNow + 20ms);
  ASSERT_EQ(shown.tools.size(), 1U);
  EXPECT_NEAR(shown.tools[0].at.distance_mm, 2.8, 1e-9);
  perimap_Surface& surface = made.surface_at(kNow + 20ms, 8);
  surface.state = perimap_SURFACE_INVALID;
  shown = gate.show(surface, kNow + 20ms);
  ASSERT_EQ(shown.tools.size(), 1U);
  EXPECT_EQ(shown.tools[0].at.refusal, client::ToolRefusal::kPublisher);
  EXPECT_FALSE(shown.tools[0].at.tip_known);
  gate.forget();
  EXPECT_TRUE(gate.show(made.surface_at(kNow + 20ms, 9), kNow + 20ms).tools.empty());
}

}  // namespace
}  // namespace perimap

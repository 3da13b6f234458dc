#include "drivers/standins/simulator/view_obstacles.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace perimap {
namespace {

constexpr int kWidth = 320, kHeight = 240;

std::vector<float> drawn(const ViewObstacles& obstacles, double t_s) {
  std::vector<float> radiance(std::size_t{kWidth} * kHeight, 7.0F);
  obstacles.draw(from_seconds(t_s), radiance);
  return radiance;
}

TEST(ViewObstacles, TheInstrumentIsDrawnWhereItCoversAndNowhereElse) {
  const ViewObstacles obstacles(3, kWidth, kHeight, true, 0, 0);
  int covered = 0, changed_outside = 0, unchanged_inside = 0;
  for (const double t_s : {0.5, 3.1, 3.5, 9.4, 15.2}) {
    const std::vector<float> radiance = drawn(obstacles, t_s);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const bool is_changed = radiance[static_cast<std::size_t>(v * kWidth + u)] != 7.0F;
        const bool is_covered = obstacles.instrument_covers(Vector2d(u, v), from_seconds(t_s), 0);
        covered += is_covered ? 1 : 0;
        changed_outside += is_changed && !is_covered ? 1 : 0;
        unchanged_inside += !is_changed && is_covered ? 1 : 0;
      }
    }
  }
  EXPECT_GT(covered, 1000);
  EXPECT_EQ(changed_outside, 0);
  EXPECT_EQ(unchanged_inside, 0);
}

TEST(ViewObstacles, TheInstrumentComesAndGoes) {
  const ViewObstacles obstacles(3, kWidth, kHeight, true, 0, 0);
  const auto is_in_view = [&](double t_s) {
    const std::vector<float> radiance = drawn(obstacles, t_s);
    return std::any_of(radiance.begin(), radiance.end(), [](float r) { return r != 7.0F; });
  };
  EXPECT_FALSE(is_in_view(1.0));
  EXPECT_TRUE(is_in_view(3.5));
  EXPECT_FALSE(is_in_view(5.5));
  EXPECT_TRUE(is_in_view(9.5));
}

TEST(ViewObstacles, GlintsOnlyAddLightAndAreTheSameEachTime) {
  const ViewObstacles obstacles(5, kWidth, kHeight, false, 10, 0);
  const std::vector<float> radiance = drawn(obstacles, 2.0);
  EXPECT_EQ(radiance, drawn(obstacles, 2.0));
  EXPECT_GE(*std::min_element(radiance.begin(), radiance.end()), 7.0F);
  EXPECT_GT(*std::max_element(radiance.begin(), radiance.end()), 100.0F);
}

TEST(ViewObstacles, SmokeComesAndGoesAndHidesNothingWholly) {
  const ViewObstacles obstacles(5, kWidth, kHeight, false, 0, 1.0);
  const std::vector<float> clear = drawn(obstacles, 6.0), smoky = drawn(obstacles, 2.5);
  EXPECT_EQ(std::count(clear.begin(), clear.end(), 7.0F), static_cast<long>(clear.size()));
  // Of a scene twice as bright as 7 grey levels the difference that is left tells the transmission.
  std::vector<float> brighter(clear.size(), 14.0F);
  obstacles.draw(from_seconds(2.5), brighter);
  float least = 1, most = 0;
  for (std::size_t i = 0; i < smoky.size(); ++i) {
    const float transmission = (brighter[i] - smoky[i]) / 7.0F;
    least = std::min(least, transmission);
    most = std::max(most, transmission);
  }
  EXPECT_GE(least, 0.36F);
  EXPECT_LT(least, 0.6F);
  EXPECT_LE(most, 1.0001F);
}

TEST(ViewObstacles, NoneLeaveThePictureAsItIs) {
  const std::vector<float> radiance = drawn(ViewObstacles(5, kWidth, kHeight, false, 0, 0), 3.5);
  EXPECT_EQ(std::count(radiance.begin(), radiance.end(), 7.0F), static_cast<long>(radiance.size()));
}

}  // namespace
}  // namespace perimap

#include "core/vision/neighbour_motion.hpp"

#include <gtest/gtest.h>

namespace perimap {
namespace {

TEST(NeighbourMotion, TellsNothingFromTooFew) {
  NeighbourMotion motion(10);
  for (std::size_t i = 0; i + 1 < NeighbourMotion::kFewest; ++i) motion.add(Vector2d(i, 0), Vector2d(i, 3));
  EXPECT_FALSE(motion.around(Vector2d::Zero(), nullptr).known);
  motion.add(Vector2d(9, 0), Vector2d(9, 3));
  const NeighbourMotion::Around around = motion.around(Vector2d::Zero(), nullptr);
  EXPECT_TRUE(around.known);
  EXPECT_EQ(around.by, Vector2d(0, 3));
  EXPECT_EQ(around.disagreement_px, 0);
  EXPECT_GT(around.distance_px, 0);
}

TEST(NeighbourMotion, OneThatJumpsDoesNotCount) {
  NeighbourMotion motion(10);
  for (int i = 0; i < 5; ++i) motion.add(Vector2d(10 * i, 0), Vector2d(10 * i + 2, 1));
  motion.add(Vector2d(5, 5), Vector2d(45, -20));
  EXPECT_EQ(motion.around(Vector2d(5, 5), nullptr).by, Vector2d(2, 1));
}

TEST(NeighbourMotion, TheNearestAreAsked) {
  NeighbourMotion motion(40);
  for (int i = 0; i < 12; ++i) {
    motion.add(Vector2d(i, 0), Vector2d(i + 1, 0));
    motion.add(Vector2d(i, 400), Vector2d(i - 7, 400));
  }
  EXPECT_EQ(motion.around(Vector2d(5, 30), nullptr).by, Vector2d(1, 0));
  EXPECT_EQ(motion.around(Vector2d(5, 370), nullptr).by, Vector2d(-7, 0));
}

TEST(NeighbourMotion, AFeatureIsNotItsOwnNeighbour) {
  NeighbourMotion motion(10);
  const Vector2d own(0, 0);
  motion.add(own, Vector2d(30, 0));
  for (int i = 1; i < 4; ++i) motion.add(Vector2d(i, 0), Vector2d(i, 0));
  EXPECT_TRUE(motion.around(own, nullptr).known);
  EXPECT_FALSE(motion.around(own, &own).known);
}

TEST(NeighbourMotion, NeighboursThatDifferSaySo) {
  NeighbourMotion motion(10);
  for (int i = 0; i < 6; ++i) motion.add(Vector2d(i, 0), Vector2d(i + 4 * i, 0));
  EXPECT_GT(motion.around(Vector2d(3, 0), nullptr).disagreement_px, 3);
}

TEST(NeighbourMotion, ForgetsTheFrameBefore) {
  NeighbourMotion motion(10);
  for (int i = 0; i < 6; ++i) motion.add(Vector2d(i, 0), Vector2d(i, 1));
  motion.clear();
  EXPECT_FALSE(motion.around(Vector2d(3, 0), nullptr).known);
}

}  // namespace
}  // namespace perimap

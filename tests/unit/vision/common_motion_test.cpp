#include "core/following/common_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "counted_allocations.hpp"

namespace perimap {
namespace {

constexpr double kTolerance_px = 3;

class CommonMotionTest : public testing::Test {
 protected:
  Vector2d somewhere() { return {across_(random_), across_(random_)}; }

  CommonMotion motion_{400};
  std::mt19937 random_{5};
  std::uniform_real_distribution<double> across_{0, 400};
};

TEST_F(CommonMotionTest, IsThatOfAGoodShareWhateverTheOthersDo) {
  Matrix2d A;
  A << 1.1, -0.2, 0.15, 1.05;
  const Vector2d t(12, -30);
  for (int i = 0; i < 90; ++i) {
    const Vector2d from = somewhere();
    motion_.add(from, i % 3 == 0 ? Vector2d(A * from + t) : somewhere());
  }
  EXPECT_GE(motion_.agree(6 * kTolerance_px), 30U);
  EXPECT_GE(motion_.agree(kTolerance_px), 8U);
  for (int i = 0; i < 20; ++i) {
    const Vector2d from = somewhere();
    EXPECT_LT((motion_.at(from) - A * from - t).norm(), 3 * kTolerance_px) << from.transpose();
  }
}

TEST_F(CommonMotionTest, BendsWhereItsNeighboursDo) {
  const auto moved = [](const Vector2d& from) { return Vector2d(from + Vector2d(20, 2.5 * std::sin(from.x() / 60))); };
  std::vector<Vector2d> places;
  for (int i = 0; i < 150; ++i) {
    places.push_back(somewhere());
    motion_.add(places.back(), moved(places.back()));
  }
  ASSERT_GE(motion_.agree(kTolerance_px), 140U);
  double sum = 0;
  for (const Vector2d& from : places) sum += (motion_.at(from, &from) - moved(from)).norm();
  EXPECT_LT(sum / 150, 1.0);  // 1.6 without the neighbours
}

// What lies behind goes another way than what lies before it, and neither is asked where the other goes.
TEST_F(CommonMotionTest, TellsOfAPlaceWhatThoseBesideItDoUnlessTheyDoNotAgree) {
  for (int x = 0; x < 400; x += 25) {
    for (int y = 0; y < 400; y += 25) {
      const Vector2d from(x, y);
      motion_.add(from, x < 200 ? Vector2d(from + Vector2d(6, 0)) : Vector2d(from - Vector2d(20, 5)));
    }
  }
  (void)motion_.agree(kTolerance_px);
  const auto left = motion_.beside({100, 200}, kTolerance_px), right = motion_.beside({300, 200}, kTolerance_px);
  ASSERT_TRUE(left && right);
  EXPECT_LT((*left - Vector2d(106, 200)).norm(), 1e-6);
  EXPECT_LT((*right - Vector2d(280, 195)).norm(), 1e-6);
  for (int i = 0; i < 60; ++i) motion_.add(Vector2d(100 + i % 8, 200 + i / 8), somewhere());
  EXPECT_FALSE(motion_.beside({104, 204}, kTolerance_px).has_value());
}

TEST_F(CommonMotionTest, StaysWhatItWasWhereNothingAgrees) {
  motion_.begin_with({5, 7});
  for (int i = 0; i < 20; ++i) motion_.add(somewhere(), somewhere());
  EXPECT_LT(motion_.agree(0.01), CommonMotion::kFewest);
  EXPECT_EQ(motion_.at({100, 200}), Vector2d(105, 207));
  EXPECT_EQ(motion_.shape(), Matrix2d::Identity());
}

TEST_F(CommonMotionTest, TakesNoMorePairsThanAnnouncedAndNothingFromTheHeap) {
  const long before = test::allocations;
  for (int i = 0; i < 500; ++i) motion_.add(Vector2d(i, 2 * (i % 50)), Vector2d(i + 3, 2 * (i % 50)));
  EXPECT_EQ(motion_.agree(1), 400U);
  EXPECT_EQ(test::allocations, before);
}

}  // namespace
}  // namespace perimap

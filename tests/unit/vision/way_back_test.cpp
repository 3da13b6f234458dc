#include "core/vision/way_back.hpp"

#include <gtest/gtest.h>

#include "core/geometry/symmetric_matrix2.hpp"
#include "core/vision/last_view.hpp"
#include "tests/unit/vision/synthetic_scene.hpp"

namespace perimap {
namespace {

constexpr int kWidth = 160, kHeight = 120;

struct WayBack : ::testing::Test {
  test::Texture texture{3};
  std::mt19937 random{1};
  PatchTracker tracker = LastView::tracker();
  const Vector2d from{80, 60}, by{3, -2};
  test::ImageBuffer before = test::render(texture, {}, kWidth, kHeight, 1, random);
  test::ImageBuffer after = test::render(texture, test::View{.t = by}, kWidth, kHeight, 1, random);

  [[nodiscard]] std::optional<double> off(const Vector2d& found) const {
    return off_on_way_back(tracker, after.view(), found, {before.view(), from, from, 3});
  }
};

TEST_F(WayBack, OfARightMatchEndsWhereItBegan) {
  const auto px = off(from + by);
  ASSERT_TRUE(px);
  EXPECT_LT(*px, 0.2);
}

TEST_F(WayBack, OfAnotherPlaceEndsAsFarAwayAsThatIs) {
  const Vector2d wrong(2, 1);
  const auto px = off(from + by + wrong);
  ASSERT_TRUE(px);
  EXPECT_NEAR(*px, wrong.norm(), 0.3);
}

TEST_F(WayBack, AtTheBorderIsNone) { EXPECT_FALSE(off({3, 3})); }

TEST_F(WayBack, OfALastViewCountsWithItsDrift) {
  LastView view;
  view.make(before.view(), 4, from, tracker.kernels());
  EXPECT_TRUE(view.is_of(4));
  EXPECT_FALSE(view.is_of(5));
  const PatchMatch first = view.follow(tracker, after.view(), before.view(), from, from, test::isotropic(3));
  ASSERT_EQ(first.state, MatchState::kFound);
  EXPECT_LT((first.px - from - by).norm(), 0.3);
  view.drift_to(first);
  const PatchMatch again = view.find_again(tracker, after.view(), from, test::isotropic(3));
  ASSERT_EQ(again.state, MatchState::kFound);
  EXPECT_GT(again.covariance_px2(0, 0), 1.5 * first.covariance_px2(0, 0));
  view.begin_at(0.7);
  EXPECT_EQ(view.drift_px2(), 0);
  const PatchMatch from_there = view.follow(tracker, after.view(), before.view(), from, from, test::isotropic(3));
  ASSERT_EQ(from_there.state, MatchState::kFound);
  EXPECT_NEAR(from_there.covariance_px2(0, 0), first.covariance_px2(0, 0) + 0.7, 1e-9)
      << "it is followed from where that was";
  view.drift_to(from_there);
  EXPECT_NEAR(view.drift_px2(), larger_eigenvalue(first.covariance_px2), 1e-9);
  view.forget();
  EXPECT_FALSE(view.is_of(4));
  EXPECT_EQ(view.began_px2(), 0);
  EXPECT_EQ(view.drift_px2(), 0);
}

}  // namespace
}  // namespace perimap

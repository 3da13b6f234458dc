#include "core/following/past_layouts.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "counted_allocations.hpp"

namespace perimap {
namespace {

class PastLayoutsTest : public testing::Test {
 protected:
  PastLayoutsTest() {
    for (std::uint32_t id = 1; id <= 3; ++id) {
      FollowedFeature& feature = features_.emplace_back();
      feature.state = FollowState::kTracked;
      feature.id = id;
      feature.found = true;
      feature.px = Vector2d(10 * id, 0);
    }
  }

  std::vector<FollowedFeature> features_;
  PastLayouts layouts_{3};
};

TEST_F(PastLayoutsTest, TellWhereAFeatureWasInTheNewestLayoutUpToAFrame) {
  layouts_.note(features_, 15);
  features_[0].px.x() = 12;
  layouts_.note(features_, 30);
  EXPECT_EQ(layouts_.newest_with(features_[0], 0, 14), 0U);
  const std::uint32_t older = layouts_.newest_with(features_[0], 0, 29);
  const std::uint32_t newer = layouts_.newest_with(features_[0], 0, 30);
  ASSERT_NE(older, 0U);
  EXPECT_EQ(layouts_.place_in(older, features_[0], 0)->x(), 10);
  EXPECT_EQ(layouts_.place_in(newer, features_[0], 0)->x(), 12);
}

TEST_F(PastLayoutsTest, HaveNothingOfWhatWasNotFoundNorOfAnotherThatHasItsPlaceNow) {
  features_[1].found = false;
  features_[2].state = FollowState::kCandidate;
  layouts_.note(features_, 15);
  EXPECT_EQ(layouts_.newest_with(features_[1], 1, 15), 0U);
  EXPECT_EQ(layouts_.newest_with(features_[2], 2, 15), 0U);
  const std::uint32_t layout = layouts_.newest_with(features_[0], 0, 15);
  features_[0].id = 9;
  EXPECT_EQ(layouts_.newest_with(features_[0], 0, 15), 0U);
  EXPECT_FALSE(layouts_.place_in(layout, features_[0], 0).has_value());
  EXPECT_FALSE(layouts_.place_in(0, features_[1], 1).has_value());
}

TEST_F(PastLayoutsTest, KeepWhatAFeatureThatIsAwayNeedsAndTakeNothingFromTheHeap) {
  layouts_.note(features_, 1);
  features_[0].layout = layouts_.newest_with(features_[0], 0, 1);
  features_[0].found = false;
  features_[0].state = FollowState::kOccluded;
  const std::uint32_t second = features_[0].layout + 1;
  const long before = test::allocations;
  for (std::uint64_t frame = 2; frame < 3 * PastLayouts::kMost; ++frame) layouts_.note(features_, frame);
  EXPECT_EQ(test::allocations, before);
  EXPECT_TRUE(layouts_.place_in(features_[0].layout, features_[0], 0).has_value());
  EXPECT_FALSE(layouts_.place_in(second, features_[1], 1).has_value());
}

}  // namespace
}  // namespace perimap

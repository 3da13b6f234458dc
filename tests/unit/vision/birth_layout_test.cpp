#include "core/following/birth_layout.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace perimap {
namespace {

constexpr double kAlike_px = 8;

// Began in one frame on a grid; the picture has turned and come nearer since.
class BirthLayoutTest : public testing::Test {
 protected:
  BirthLayoutTest() {
    for (int i = 0; i < 25; ++i) {
      FollowedFeature& feature = features_.emplace_back();
      feature.state = FollowState::kTracked;
      feature.found = true;
      feature.first_frame = 7;
      feature.first_px = Vector2d(40 * (i % 5), 40 * (i / 5));
      feature.px = Vector2d(10, 4) + Vector2d(1.1 * feature.first_px.x() - 0.1 * feature.first_px.y(),
                                              1.1 * feature.first_px.y() + 0.1 * feature.first_px.x());
    }
  }

  // Of the one in the middle, which has been away.
  std::optional<double> off_px() {
    FollowedFeature& feature = features_[12];
    feature.is_away = true;
    return off_among_its_own(features_, feature, kAlike_px, motion_);
  }

  std::vector<FollowedFeature> features_;
  CommonMotion motion_{25};
};

TEST_F(BirthLayoutTest, TellsHowFarAFeatureIsFromWhereThoseThatBeganWithItHaveIt) {
  ASSERT_TRUE(off_px());
  EXPECT_NEAR(*off_px(), 0, 1e-6);
  features_[12].px += Vector2d(12, 16);
  EXPECT_NEAR(*off_px(), 20, 1e-6);
}

TEST_F(BirthLayoutTest, AsksNoneThatBeganInAnotherFrameOrHasBeenAway) {
  for (const std::size_t i : {6U, 7U, 8U}) {
    features_[i].px += Vector2d(0, 5);
    features_[i].first_frame = 8;
    features_[i + 10].px += Vector2d(0, 5);
    features_[i + 10].is_away = true;
  }
  ASSERT_TRUE(off_px());
  EXPECT_NEAR(*off_px(), 0, 1e-6);
}

TEST_F(BirthLayoutTest, SaysNothingWhereTheOthersAreFewOrDoNotAgree) {
  for (std::size_t i = 0; i < 20; ++i) features_[i].px = Vector2d(97 * i * i % 401, 53 * i * i % 307);
  EXPECT_FALSE(off_px());
  for (std::size_t i = 0; i < 14; ++i) features_[i].found = i == 12;
  EXPECT_FALSE(off_px());
}

TEST_F(BirthLayoutTest, SaysNothingWhereWhatIsAroundItLiesAtAnotherDepth) {
  for (const std::size_t i : {6U, 7U, 8U, 11U, 13U}) features_[i].px += Vector2d(0, 40);
  EXPECT_FALSE(off_px());
}

}  // namespace
}  // namespace perimap

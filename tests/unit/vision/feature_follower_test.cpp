#include "core/vision/feature_follower.hpp"

#include <gtest/gtest.h>

#include <map>

#include "core/vision/feature_detector.hpp"
#include "core/vision/instrument_mask.hpp"
#include "counted_allocations.hpp"
#include "tests/unit/vision/synthetic_scene.hpp"

namespace perimap {
namespace {

using test::ImageBuffer;
using test::render;
using test::Texture;
using test::View;

constexpr int kWidth = 321, kHeight = 241;
constexpr int kFeatures = 40;

// A texture that slides under the camera, and what the follower makes of it.
class FeatureFollowerTest : public testing::Test {
 protected:
  FeatureFollowerTest() : follower_(settings()) {}

  static FollowerSettings settings() {
    FollowerSettings settings;
    settings.maximum = kFeatures;
    settings.occluded_frames = 30;
    return settings;
  }

  static View view_at(const Vector2d& shift) {
    View view;
    view.t = shift;
    return view;
  }

  void show(const Vector2d& shift) {
    image_ = render(Texture(3), view_at(shift), kWidth, kHeight, 1, random_, 5);
    shift_ = shift;
  }

  void find() {
    std::vector<Vector2d> occupied;
    for (const FollowedFeature& feature : follower_.features()) {
      if (feature.state != FollowState::kEmpty) occupied.push_back(feature.px);
    }
    const double noise = estimate_noise(image_.view());
    const DetectorSettings detector = detector_settings_for(kWidth, kHeight, noise, kFeatures);
    const auto corners = find_features(image_.view(), occupied, detector, follower_.free());
    ASSERT_TRUE(corners.has_value());
    follower_.add(image_.view(), *corners, template_settings_for(detector.min_corner));
    note_places();
  }

  void note_places() {
    for (const FollowedFeature& feature : follower_.features()) {
      if (feature.found) places_.try_emplace(feature.id, Vector2d(feature.px - shift_));
    }
  }

  void follow() {
    follower_.follow(image_.view());
    note_places();
  }

  [[nodiscard]] int count(FollowState state) const {
    int n = 0;
    for (const FollowedFeature& feature : follower_.features()) n += feature.state == state ? 1 : 0;
    return n;
  }

  // Of the features found, how far the worst is from where its tissue has gone.
  [[nodiscard]] double worst_px() const {
    double worst = 0;
    for (const FollowedFeature& feature : follower_.features()) {
      if (feature.found) worst = std::max(worst, (feature.px - shift_ - places_.at(feature.id)).norm());
    }
    return worst;
  }

  std::mt19937 random_{4};
  ImageBuffer image_{1, 1};
  Vector2d shift_ = Vector2d::Zero();
  FeatureFollower follower_;
  std::map<std::uint32_t, Vector2d> places_;
};

TEST_F(FeatureFollowerTest, FollowsSteadyMotionAndPromotesItsCandidates) {
  show({0, 0});
  find();
  const int candidates = count(FollowState::kCandidate);
  ASSERT_GE(candidates, 25);
  for (int k = 1; k <= 12; ++k) {
    show({2.3 * k, -1.1 * k});
    follow();
  }
  EXPECT_GE(count(FollowState::kTracked), candidates * 6 / 10);  // some leave the view
  EXPECT_LT(worst_px(), 0.5);
}

TEST_F(FeatureFollowerTest, KeepsItsFeaturesWhenTheCameraJerks) {
  show({0, 0});
  find();
  for (int k = 1; k <= 10; ++k) {
    show({0.5 * k, 0});
    follow();
  }
  const int before = count(FollowState::kTracked);
  show({5 + 22, -14});
  follow();
  int found = 0;
  for (const FollowedFeature& feature : follower_.features()) found += feature.found ? 1 : 0;
  EXPECT_GE(found, before * 6 / 10);
  EXPECT_LT(worst_px(), 0.5);
}

TEST_F(FeatureFollowerTest, FindsTheSameFeaturesAgainAfterAnOcclusion) {
  show({0, 0});
  find();
  for (int k = 1; k <= 10; ++k) {
    show({0.5 * k, 0});
    follow();
  }
  std::vector<std::uint32_t> hidden;
  for (int k = 11; k <= 25; ++k) {
    show({0.5 * k, 0});
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 110; u < 190; ++u) image_.at(u, v) = static_cast<std::uint8_t>(100 + (u + v) % 3);
    }
    follow();
    if (k != 20) continue;
    for (const FollowedFeature& feature : follower_.features()) {
      if (feature.state == FollowState::kOccluded) hidden.push_back(feature.id);
      const bool is_covered = feature.px.x() > 115 && feature.px.x() < 185;
      EXPECT_FALSE(feature.found && is_covered) << feature.px.transpose();
    }
  }
  ASSERT_GE(hidden.size(), 4U);
  for (int k = 26; k <= 30; ++k) {
    show({0.5 * k, 0});
    follow();
  }
  std::size_t back = 0;
  for (const FollowedFeature& feature : follower_.features()) {
    back += feature.found && std::find(hidden.begin(), hidden.end(), feature.id) != hidden.end() ? 1 : 0;
  }
  EXPECT_GE(back * 10, hidden.size() * 9);
  EXPECT_LT(worst_px(), 0.6);
}

TEST_F(FeatureFollowerTest, GivesUpWhatStaysAway) {
  show({0, 0});
  find();
  follow();
  image_ = ImageBuffer(kWidth, kHeight);
  for (int k = 0; k < 40; ++k) follow();
  EXPECT_EQ(follower_.free(), kFeatures);
}

TEST_F(FeatureFollowerTest, TakesNothingFromTheHeapToFollow) {
  show({0, 0});
  find();
  show({3, 1});
  const long before = test::allocations;
  follower_.follow(image_.view());
  EXPECT_EQ(test::allocations, before);
}

TEST(NoiseEstimate, IsTheNoisesDeviationOnTexture) {
  std::mt19937 random(2);
  for (const double sigma : {1.0, 2.0, 4.0}) {
    const ImageBuffer image = render(Texture(3, 20, 12, 90), View{}, kWidth, kHeight, sigma, random);
    EXPECT_NEAR(estimate_noise(image.view()), sigma, 0.15 * sigma + 0.1);
  }
  EXPECT_EQ(estimate_noise(ImageBuffer(20, 20).view()), 0);
  EXPECT_EQ(estimate_noise(GreyImage{}), 0);
}

TEST(InstrumentMask, IsWhatHasNoColourUnlessAlmostNothingHas) {
  constexpr int kSide = 160;
  std::vector<std::uint8_t> bgr(std::size_t{3} * kSide * kSide);
  const auto fill = [&](int first_row, int last_row, std::array<std::uint8_t, 3> colour) {
    for (int y = first_row; y < last_row; ++y) {
      for (int x = 0; x < kSide; ++x) std::copy(colour.begin(), colour.end(), bgr.begin() + 3 * (y * kSide + x));
    }
  };
  fill(0, kSide, {70, 80, 180});
  fill(40, 80, {120, 122, 125});
  const auto mask = find_instruments({bgr.data(), kSide, kSide, 3 * kSide});
  ASSERT_TRUE(mask.has_value());
  EXPECT_EQ((*mask)[60 * kSide + 80], 255);
  EXPECT_EQ((*mask)[120 * kSide + 80], 0);
  fill(0, kSide, {100, 100, 100});
  const auto grey = find_instruments({bgr.data(), kSide, kSide, 3 * kSide});
  ASSERT_TRUE(grey.has_value());
  EXPECT_EQ(std::count(grey->begin(), grey->end(), 255), 0);
  EXPECT_FALSE(find_instruments({}).has_value());
}

}  // namespace
}  // namespace perimap

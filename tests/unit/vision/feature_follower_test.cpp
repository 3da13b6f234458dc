#include "core/following/feature_follower.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "core/vision/feature_detector.hpp"
#include "core/vision/image_noise.hpp"
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
    settings.occluded = settings.hidden = std::chrono::seconds(1);
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
    const std::vector<Vector2d> occupied = follower_.occupied();
    const double noise = estimate_noise(image_.view());
    const DetectorSettings detector = detector_settings_for(kWidth, kHeight, noise, kFeatures);
    const auto corners = find_features(image_.view(), occupied, detector, follower_.free());
    ASSERT_TRUE(corners.has_value());
    follower_.add(image_.view(), *corners, template_settings_for(detector));
    note_places();
  }

  void note_places() {
    for (const FollowedFeature& feature : follower_.features()) {
      if (feature.found) places_.try_emplace(feature.id, Vector2d(feature.px - shift_));
    }
  }

  void follow() {
    follower_.track_into(image_.view());
    note_places();
  }

  // From the first frame on, which slides so far a frame: candidates are tracked then.
  void track_ten_frames(double step_px) {
    show({0, 0});
    find();
    for (int k = 1; k <= 10; ++k) {
      show({step_px * k, 0});
      follow();
    }
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
  EXPECT_GE(count(FollowState::kTracked), std::min(candidates, kFeatures) * 6 / 10);  // some leave the view
  EXPECT_LE(count(FollowState::kTracked), kFeatures);                                 // however many were tried
  EXPECT_LT(worst_px(), 0.5);
}

// Within 40 frames one texture turns into another that goes the same way.
TEST_F(FeatureFollowerTest, KeepsFeaturesThatTurnIntoOthersByAndBy) {
  track_ten_frames(0.5);
  const int before = count(FollowState::kTracked);
  ASSERT_GE(before, 25);
  for (int k = 11; k <= 50; ++k) {
    show({0.5 * k, 0});
    const ImageBuffer other = render(Texture(9), view_at(shift_), kWidth, kHeight, 1, random_, 5);
    const double share = (k - 10) / 40.0;
    for (std::size_t i = 0; i < image_.pixels.size(); ++i) {
      image_.pixels[i] =
          static_cast<std::uint8_t>(std::lround((1 - share) * image_.pixels[i] + share * other.pixels[i]));
    }
    follow();
  }
  int found = 0;
  for (const FollowedFeature& feature : follower_.features()) {
    found += feature.found && feature.state == FollowState::kTracked ? 1 : 0;
  }
  EXPECT_GE(found, before / 2);
  EXPECT_LT(worst_px(), 3);
}

TEST_F(FeatureFollowerTest, KeepsItsFeaturesWhenTheCameraJerks) {
  track_ten_frames(0.5);
  const int before = count(FollowState::kTracked);
  show({5 + 22, -14});
  follow();
  int found = 0;
  for (const FollowedFeature& feature : follower_.features()) found += feature.found ? 1 : 0;
  EXPECT_GE(found, before * 6 / 10);
  EXPECT_LT(worst_px(), 0.5);
}

TEST_F(FeatureFollowerTest, FindsTheSameFeaturesAgainAfterAnOcclusion) {
  track_ten_frames(0.5);
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
  for (int k = 0; k < 10; ++k) follow();
  ASSERT_GE(count(FollowState::kTracked), 20);
  for (int k = 0; k < 40; ++k) {
    image_ = render(Texture(8), View{}, kWidth, kHeight, 1, random_, 5);
    follow();
  }
  EXPECT_EQ(count(FollowState::kEmpty), static_cast<int>(follower_.features().size()));
}

TEST_F(FeatureFollowerTest, FillsUpAtOnceAfterACutAndKeepsNothingOfTheScenesBefore) {
  track_ten_frames(2.0);
  std::set<std::uint32_t> before;
  for (const FollowedFeature& feature : follower_.features()) before.insert(feature.id);
  for (int k = 1; k <= 20; ++k) {
    image_ = render(Texture(8), view_at({2.0 * k, 0}), kWidth, kHeight, 1, random_, 5);
    follower_.track_into(image_.view());
    for (const FollowedFeature& feature : follower_.features()) {
      EXPECT_FALSE(feature.found && before.contains(feature.id)) << feature.id << " in frame " << k;
    }
    if (k % 5 == 0) find();
  }
  EXPECT_GE(count(FollowState::kTracked), 25);
}

TEST_F(FeatureFollowerTest, WhatIsAwayForMoreThanAMomentNeitherFillsAPlaceNorKeepsOthersAway) {
  show({0, 0});
  find();
  for (int k = 0; k < 10; ++k) follow();
  const int free_before = follower_.free();
  for (int k = 0; k < 6; ++k) {
    show({0, 0});
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth / 2; ++u) image_.at(u, v) = static_cast<std::uint8_t>(100 + (u + v) % 3);
    }
    follow();
  }
  const int away = count(FollowState::kOccluded);
  ASSERT_GE(away, 8);
  EXPECT_GE(follower_.free(), free_before + away - 2);
  for (const Vector2d& px : follower_.occupied()) EXPECT_GT(px.x(), kWidth / 2 - 12);
}

TEST_F(FeatureFollowerTest, FindsItsFeaturesAgainAfterABlackoutInWhichTheCameraMoved) {
  track_ten_frames(2.0);
  const int before = count(FollowState::kTracked);
  for (int k = 0; k < 60; ++k) {
    image_ = ImageBuffer(kWidth, kHeight);
    for (std::uint8_t& pixel : image_.pixels) pixel = static_cast<std::uint8_t>(random_() % 4);
    follower_.track_into(image_.view());
    for (const FollowedFeature& feature : follower_.features()) EXPECT_FALSE(feature.found);
  }
  for (int k = 0; k < 3; ++k) {
    show({28, -6});
    follow();
  }
  EXPECT_GE(count(FollowState::kTracked), before * 7 / 10);
  EXPECT_LT(worst_px(), 0.5);
}

// All of it vanishes behind another picture; the camera has turned and come nearer when it is back.
TEST_F(FeatureFollowerTest, FindsItsFeaturesAgainWhereTheCameraHasTurnedMeanwhile) {
  track_ten_frames(0.5);
  const int before = count(FollowState::kTracked);
  ASSERT_GE(before, 25);
  for (int k = 0; k < 8; ++k) {
    image_ = render(Texture(8), View{}, kWidth, kHeight, 1, random_, 5);
    follower_.track_into(image_.view());
  }
  View view;
  view.A << 1.06, -0.08, 0.08, 1.06;
  view.t = Vector2d(160, 120) - view.A * Vector2d(160, 120) + Vector2d(5, -3);
  int back = 0, wrong = 0;
  for (int k = 0; k < 3; ++k) {
    image_ = render(Texture(3), view, kWidth, kHeight, 1, random_, 5);
    follower_.track_into(image_.view());
  }
  for (const FollowedFeature& feature : follower_.features()) {
    if (!feature.found || feature.state != FollowState::kTracked) continue;
    ++((feature.px - view.A * places_.at(feature.id) - view.t).norm() < 1 ? back : wrong);
  }
  EXPECT_GE(back, before * 6 / 10);  // some leave the view
  EXPECT_EQ(wrong, 0);
}

// What is nearer to the lens has moved otherwise than what is behind it.
TEST_F(FeatureFollowerTest, FindsFeaturesOfTwoDepthsAgain) {
  track_ten_frames(0.5);
  for (int k = 0; k < 8; ++k) {
    image_ = render(Texture(8), View{}, kWidth, kHeight, 1, random_, 5);
    follower_.track_into(image_.view());
  }
  const std::array<Vector2d, 2> shifts = {Vector2d(5, 2), Vector2d(30, -18)};
  std::array<int, 2> back{};
  int wrong = 0;
  for (int k = 0; k < 3; ++k) {
    const ImageBuffer near = render(Texture(3), view_at(shifts[1]), kWidth, kHeight, 1, random_, 5);
    show(shifts[0]);
    for (int v = 0; v < kHeight; ++v) {
      std::copy_n(near.pixels.begin() + v * near.stride, kWidth / 2, image_.pixels.begin() + v * image_.stride);
    }
    follower_.track_into(image_.view());
  }
  for (const FollowedFeature& feature : follower_.features()) {
    if (!feature.found || feature.state != FollowState::kTracked) continue;
    const std::size_t side = feature.px.x() < kWidth / 2.0 ? 1 : 0;
    ++((feature.px - shifts[side] - places_.at(feature.id)).norm() < 1 ? back[side] : wrong);
  }
  EXPECT_GE(back[0], 10);
  EXPECT_GE(back[1], 10);
  EXPECT_EQ(wrong, 0);
}

// A chequered sign over the picture.
void lay_sign_over(ImageBuffer& image, int left, int top) {
  constexpr int kSide = 72, kField = 9;
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      image.at(left + u, top + v) = (u / kField * 5 + v / kField * 3) % 7 < 3 ? 220 : 60;
    }
  }
}

TEST_F(FeatureFollowerTest, LetsGoOfWhatIsLaidOverThePictureAndTakesItNoMore) {
  constexpr int kLeft = 60, kTop = 40, kSide = 72;
  const auto on_sign = [&](const Vector2d& px) {
    return px.x() >= kLeft && px.x() < kLeft + kSide && px.y() >= kTop && px.y() < kTop + kSide;
  };
  int at_first = 0, tracked = 0;
  for (int k = 0; k <= 60; ++k) {
    image_ =
        render(Texture(3), view_at({25 * std::sin(0.08 * k), 10 * std::sin(0.06 * k)}), kWidth, kHeight, 1, random_, 5);
    lay_sign_over(image_, kLeft, kTop);
    follower_.track_into(image_.view());
    if (k % 5 == 0) find();
    for (const FollowedFeature& feature : follower_.features()) {
      if (!feature.found || !on_sign(feature.px)) continue;
      at_first += k == 0 ? 1 : 0;
      tracked += k > 20 && feature.state == FollowState::kTracked ? 1 : 0;
    }
  }
  EXPECT_GE(at_first, 3);
  EXPECT_EQ(tracked, 0);
  EXPECT_GE(count(FollowState::kTracked), 20);
}

// The left half is held; the right one is stretched, by 8 px and more at its end.
TEST_F(FeatureFollowerTest, KeepsTissueThatStandsStillBesideABeatingPart) {
  std::set<std::uint32_t> still;
  for (int k = 0; k <= 60; ++k) {
    View view;
    const double stretch = 0.05 * std::sin(0.25 * k);
    view.A(1, 0) = stretch;
    view.A(0, 0) = 1 + stretch;
    view.t = kWidth / 2 * (Vector2d(1, 0) - view.A.col(0));
    const ImageBuffer rest = render(Texture(3), View{}, kWidth, kHeight, 1, random_, 5);
    image_ = render(Texture(3), view, kWidth, kHeight, 1, random_, 5);
    for (int v = 0; v < kHeight; ++v) {
      std::copy_n(rest.pixels.begin() + v * rest.stride, kWidth / 2, image_.pixels.begin() + v * image_.stride);
    }
    follower_.track_into(image_.view());
    if (k == 0) find();
    if (k == 10) {
      for (const FollowedFeature& feature : follower_.features()) {
        if (feature.state == FollowState::kTracked && feature.px.x() < kWidth / 2 - 15) still.insert(feature.id);
      }
    }
  }
  ASSERT_GE(still.size(), 8U);
  std::size_t kept = 0;
  for (const FollowedFeature& feature : follower_.features()) kept += feature.found ? still.count(feature.id) : 0;
  EXPECT_EQ(kept, still.size());
}

TEST_F(FeatureFollowerTest, TakesNothingFromTheHeapToFollow) {
  show({0, 0});
  find();
  ImageBuffer cut = render(Texture(8), View{}, kWidth, kHeight, 1, random_, 5);
  lay_sign_over(cut, 60, 40);
  const ImageBuffer black(kWidth, kHeight);
  std::vector<ImageBuffer> frames;
  for (int k = 0; k < 25; ++k) {
    show({1.0 * k, 0.5 * k});
    lay_sign_over(image_, 60, 40);
    frames.push_back(image_);
    if (k == 0) find();
  }
  const long before = test::allocations;
  for (const ImageBuffer& frame : frames) follower_.track_into(frame.view());
  for (const ImageBuffer* frame : std::initializer_list<const ImageBuffer*>{&cut, &black, &frames.back()})
    follower_.track_into(frame->view());
  EXPECT_EQ(test::allocations, before);
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
  const auto mask = find_instruments({bgr.data(), kSide, kSide, 3 * kSide}, kSide, kSide);
  ASSERT_TRUE(mask.has_value());
  EXPECT_EQ((*mask)[60 * kSide + 80], 255);
  EXPECT_EQ((*mask)[120 * kSide + 80], 0);
  // Thin, in a small picture.
  fill(0, kSide, {70, 80, 180});
  fill(56, 68, {120, 122, 125});
  EXPECT_EQ(find_instruments({bgr.data(), kSide, kSide, 3 * kSide}, kSide, kSide).value()[62 * kSide + 80], 255);
  fill(0, kSide, {100, 100, 100});
  const auto grey = find_instruments({bgr.data(), kSide, kSide, 3 * kSide}, kSide, kSide);
  ASSERT_TRUE(grey.has_value());
  EXPECT_EQ(std::count(grey->begin(), grey->end(), 255), 0);
  EXPECT_FALSE(find_instruments({}, kSide, kSide).has_value());
}

TEST(InstrumentMask, HasThinShaftsInPicturesOfAnySize) {
  constexpr int kShown = 200;
  for (const auto& [width, thick] :
       {std::pair{160, 16}, std::pair{640, 16}, std::pair{1920, 26}, std::pair{3840, 26}}) {
    for (int first = 100; first < 104; ++first) {
      std::vector<std::uint8_t> bgr;
      for (int y = 0; y < kShown; ++y) {
        const bool shaft = y >= first && y < first + thick;
        for (int x = 0; x < width; ++x) {
          for (const int value : shaft ? std::array{120, 122, 125} : std::array{70, 80, 180}) {
            bgr.push_back(static_cast<std::uint8_t>(value));
          }
        }
      }
      const auto mask = find_instruments({bgr.data(), width, kShown, std::ptrdiff_t{3} * width}, width, kShown).value();
      const auto barred = [&](int y) { return mask[static_cast<std::size_t>(y * width + width / 2)] != 0; };
      for (int y = first - 10; y < first + thick + 10; ++y) EXPECT_TRUE(barred(y)) << width << " " << first << " " << y;
      EXPECT_FALSE(barred(first - std::max(16, width / 80) - 12)) << width;
    }
  }
}

}  // namespace
}  // namespace perimap

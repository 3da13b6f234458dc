#include "core/vision/feature_detector.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <thread>
#include <tuple>
#include <vector>

#include "tests/unit/vision/synthetic_scene.hpp"

namespace perimap {
namespace {

using test::ImageBuffer;
using test::render;
using test::Texture;
using test::View;

constexpr int kWidth = 321, kHeight = 241;

ImageBuffer textured() {
  std::mt19937 random(2);
  return render(Texture(3), View{}, kWidth, kHeight, 2, random, 5);
}

void darken_outside_circle(ImageBuffer& image, double u, double v, double radius) {
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (std::hypot(x - u, y - v) > radius) image.at(x, y) = static_cast<std::uint8_t>(3 + (x * 7 + y * 3) % 5);
    }
  }
}

std::vector<Vector2d> found_in(const ImageBuffer& image, std::span<const Vector2d> occupied, int how_many) {
  const auto found = find_features(image.view(), occupied, DetectorSettings{}, how_many);
  EXPECT_TRUE(found.has_value());
  return found.value_or(std::vector<Vector2d>{});
}

TEST(FeatureDetector, SpreadsFeaturesOverTheFrame) {
  const std::vector<Vector2d> found = found_in(textured(), {}, 36);
  ASSERT_GE(found.size(), 30U);
  int quadrants[4] = {};
  for (const Vector2d& px : found) ++quadrants[(px.x() > kWidth / 2 ? 1 : 0) + (px.y() > kHeight / 2 ? 2 : 0)];
  for (int count : quadrants) EXPECT_GE(count, 5);
}

TEST(FeatureDetector, KeepsItsDistanceFromBorderFeaturesAndOccupiedPlaces) {
  const ImageBuffer image = textured();
  const std::vector<Vector2d> occupied = found_in(image, {}, 20);
  const std::vector<Vector2d> found = found_in(image, occupied, 60);
  ASSERT_FALSE(found.empty());
  const DetectorSettings settings;
  std::vector<Vector2d> all = occupied;
  for (const Vector2d& px : found) {
    EXPECT_GE(px.x(), settings.border_px);
    EXPECT_GE(px.y(), settings.border_px);
    EXPECT_LT(px.x(), kWidth - settings.border_px);
    EXPECT_LT(px.y(), kHeight - settings.border_px);
    for (const Vector2d& other : all) EXPECT_GE((px - other).norm(), settings.min_distance_px);
    all.push_back(px);
  }
}

TEST(FeatureDetector, GivesNoMoreThanAskedFor) {
  const ImageBuffer image = textured();
  EXPECT_EQ(found_in(image, {}, 7).size(), 7U);
  EXPECT_TRUE(found_in(image, {}, 0).empty());
  EXPECT_TRUE(found_in(image, {}, -3).empty());
}

TEST(FeatureDetector, StaysAwayFromTheDarkRimAndItsSilhouette) {
  ImageBuffer image = textured();
  darken_outside_circle(image, 160, 120, 100);
  const std::vector<Vector2d> found = found_in(image, {}, 100);
  ASSERT_FALSE(found.empty());
  for (const Vector2d& px : found) EXPECT_LT((px - Vector2d(160, 120)).norm(), 100 - 12);
}

TEST(FeatureDetector, StaysAwayFromHighlights) {
  ImageBuffer image = textured();
  for (int y = 100; y < 130; ++y) {
    for (int x = 140; x < 170; ++x) image.at(x, y) = 255;
  }
  const std::vector<Vector2d> found = found_in(image, {}, 200);
  ASSERT_FALSE(found.empty());
  for (const Vector2d& px : found) {
    const double dx = std::max({140 - px.x(), px.x() - 169, 0.0}), dy = std::max({100 - px.y(), px.y() - 129, 0.0});
    EXPECT_GT(std::hypot(dx, dy), DetectorSettings{}.highlight_clearance_px - 1);
  }
}

TEST(FeatureDetector, FindsNothingOnFlatOrBlackFrames) {
  std::mt19937 random(2);
  EXPECT_TRUE(found_in(render(Texture(3, 0), View{}, kWidth, kHeight, 2, random), {}, 50).empty());
  EXPECT_TRUE(found_in(ImageBuffer(kWidth, kHeight), {}, 50).empty());
  EXPECT_TRUE(found_in(ImageBuffer(1, 1), {}, 50).empty());
  EXPECT_TRUE(found_in(ImageBuffer(640, 2), {}, 50).empty());
}

TEST(FeatureDetector, GivesTheSameListEachTime) {
  const ImageBuffer image = textured();
  EXPECT_EQ(found_in(image, {}, 40), found_in(image, {}, 40));
}

TEST(FeatureDetector, WorksInSeveralThreadsOfAProcessAtOnce) {
  // A small picture, so that the threads meet in what surrounds the search.
  std::mt19937 random(2);
  const ImageBuffer image = render(Texture(3), View{}, 64, 48, 2, random, 5);
  constexpr int kThreads = 4, kEach = 2000;
  std::array<std::vector<std::vector<Vector2d>>, kThreads> found;
  std::vector<std::thread> threads;
  for (auto& of_thread : found) {
    threads.emplace_back([&] {
      for (int i = 0; i < kEach; ++i) of_thread.push_back(found_in(image, {}, 20));
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& of_thread : found) {
    ASSERT_EQ(of_thread.size(), static_cast<std::size_t>(kEach));
    for (const auto& list : of_thread) ASSERT_EQ(list, found[0][0]);
  }
}

TEST(FeatureDetector, FindsInEachBandOfRowsWhatItFindsInTheWholePicture) {
  ImageBuffer image = textured();
  // What is dark, and what is white, bar places across the bands.
  for (int y = 60; y < 75; ++y) {
    for (int x = 40; x < 140; ++x) image.at(x, y) = 0;
  }
  for (int y = 112; y < 115; ++y) {
    for (int x = 200; x < 203; ++x) image.at(x, y) = 255;
  }
  DetectorSettings settings;
  settings.min_distance_px = 0;  // so that no corner takes another's place
  constexpr int kAll = 1000;
  for (const int border_px : {0, DetectorSettings{}.border_px}) {
    settings.border_px = border_px;
    const auto whole = find_features(image.view(), {}, settings, kAll);
    ASSERT_TRUE(whole.has_value());
    std::vector<Vector2d> in_bands;
    for (const RowRange& rows : {RowRange{0, 100}, RowRange{100, 101}, RowRange{101, 200}, RowRange{200, kHeight}}) {
      const auto found = find_features(image.view(), {}, settings, kAll, {}, rows);
      ASSERT_TRUE(found.has_value());
      for (const Vector2d& px : *found) {
        EXPECT_GE(px.y(), rows.begin);
        EXPECT_LT(px.y(), rows.end);
        in_bands.push_back(px);
      }
    }
    const auto before = [](const Vector2d& a, const Vector2d& b) {
      return std::tuple(a.y(), a.x()) < std::tuple(b.y(), b.x());
    };
    std::vector<Vector2d> all = *whole;
    std::sort(all.begin(), all.end(), before);
    std::sort(in_bands.begin(), in_bands.end(), before);
    ASSERT_GE(all.size(), 50U);
    EXPECT_EQ(in_bands, all) << "border " << border_px;
  }
  for (int bands = 1; bands < 8; ++bands) {
    for (int y = 0; y < kHeight; ++y) {
      const RowRange rows = rows_of_band(kHeight, band_of_row(kHeight, y, bands), bands);
      EXPECT_TRUE(rows.begin <= y && y < rows.end) << y << " of " << bands;
    }
  }
  for (const RowRange& none : {RowRange{kHeight, kHeight + 50}, RowRange{60, 60}, RowRange{80, 20}, RowRange{-50, 0}}) {
    EXPECT_EQ(find_features(image.view(), {}, settings, kAll, {}, none).value().size(), 0U) << none.begin;
  }
}

TEST(FeatureDetector, KeepsItsDistanceFromOccupiedPlacesBeyondTheBand) {
  const ImageBuffer image = textured();
  DetectorSettings settings;
  settings.min_distance_px = 40;  // farther than the border that is read with the band
  const RowRange rows{120, 200};
  std::vector<Vector2d> occupied;
  for (int x = 0; x < kWidth; x += 10) occupied.emplace_back(x, rows.begin - 30);
  const auto found = find_features(image.view(), occupied, settings, 20, {}, rows);
  ASSERT_TRUE(found.has_value());
  ASSERT_FALSE(found->empty());
  for (const Vector2d& px : *found) {
    for (const Vector2d& taken : occupied) EXPECT_GE((px - taken).norm(), settings.min_distance_px);
  }
}

TEST(FeatureDetector, KnowsHighlightsInVideoOfLimitedRange) {
  ImageBuffer image = textured();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool highlight = std::hypot(x - 160, y - 120) < 6;
      image.at(x, y) = static_cast<std::uint8_t>(highlight ? 235 : 16 + 200 * image.at(x, y) / 255);
    }
  }
  const DetectorSettings settings = detector_settings_for(image.view(), 40);
  EXPECT_LT(settings.highlight_grey, 235);
  EXPECT_LE(template_settings_for(settings).saturated_grey, 235);
  const auto found = find_features(image.view(), {}, settings, 400);
  ASSERT_TRUE(found.has_value());
  ASSERT_GE(found->size(), 20U);
  for (const Vector2d& px : *found) EXPECT_GT((px - Vector2d(160, 120)).norm(), settings.highlight_clearance_px);
  image.at(20, 20) = image.at(21, 20) = image.at(40, 44) = image.at(80, 44) = 255;
  for (int x = 0; x < kWidth; ++x) image.at(x, 3) = 255;
  EXPECT_EQ(detector_settings_for(image.view(), 40).highlight_grey, DetectorSettings{}.highlight_grey);
}

TEST(FeatureDetector, SaysWhatItCannotUse) {
  EXPECT_FALSE(find_features(GreyImage{}, {}, DetectorSettings{}, 5).has_value());
  const ImageBuffer image(64, 64);
  GreyImage narrow = image.view();
  narrow.stride = 10;
  EXPECT_FALSE(find_features(narrow, {}, DetectorSettings{}, 5).has_value());
  DetectorSettings settings;
  settings.tile_px = 0;
  const auto refused = find_features(image.view(), {}, settings, 5);
  ASSERT_FALSE(refused.has_value());
  EXPECT_NE(refused.error().message.find("tile_px"), std::string::npos);
}

std::vector<Vector2d> found_by_light(const ImageBuffer& image, int how_many) {
  const auto found = find_features(image.view(), {}, detector_settings_for(image.view(), how_many), how_many);
  EXPECT_TRUE(found.has_value());
  return found.value_or(std::vector<Vector2d>{});
}

TEST(FeatureDetector, FindsAsManyInADimPicture) {
  std::mt19937 random(2);
  View view;
  const std::size_t bright = found_by_light(render(Texture(3), view, kWidth, kHeight, 1, random), 40).size();
  ASSERT_GE(bright, 25U);
  view.gain = 0.15;  // contrast and light alike
  EXPECT_GE(10 * found_by_light(render(Texture(3), view, kWidth, kHeight, 0.3, random), 40).size(), 8 * bright);
}

TEST(FeatureDetector, AsksNoLessOfABrightPictureThanItsNoiseDemands) {
  for (const double lit : {90.0, 120.0, 200.0}) {
    const DetectorSettings settings = detector_settings_for(1280, 720, 0.1, 200, {lit, 0});
    EXPECT_EQ(settings.min_corner, 0.5);
    EXPECT_EQ(settings.background_grey, DetectorSettings{}.background_grey);
  }
}

TEST(FeatureDetector, KeepsClearOfTheRimOfAViewWhoseSurroundIsNotBlack) {
  constexpr double kRadius = 100;
  ImageBuffer image = textured();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      // Rough enough for corners along the rim.
      const double angle = std::atan2(y - 120, x - 160);
      if (std::hypot(x - 160, y - 120) > kRadius + 3 * std::sin(17 * angle))
        image.at(x, y) = static_cast<std::uint8_t>(24 + (x * 7 + y * 3) % 5);
    }
  }
  const std::vector<Vector2d> found = found_by_light(image, 60);
  EXPECT_GE(found.size(), 20U);
  for (const Vector2d& px : found) EXPECT_LT((px - Vector2d(160, 120)).norm(), kRadius - 8);
}

// A view that does not fill the picture leaves a dark surround, whose edge goes with the scope; a shadow is tissue's.
TEST(FeatureDetector, KeepsATemplateFromTheSurroundAndGoesNearerToAShadow) {
  constexpr int kSide = 256;
  constexpr double kView_px = 115, kShadow_px = 25, kTemplate_px = PatchTemplate::kReach + 1;
  const Vector2d centre(128, 128), shadow(140, 120);
  std::mt19937 random(1);
  test::ImageBuffer image = test::render(test::Texture(3, 15, 6, 60), {}, kSide, kSide, 1.5, random);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const Vector2d px(x, y);
      if ((px - centre).norm() > kView_px || (px - shadow).norm() < kShadow_px) image.at(x, y) = 4;
    }
  }
  const auto found = find_features(image.view(), {}, detector_settings_for_trial(image.view(), 600), 600);
  ASSERT_TRUE(found);
  double nearest_to_edge = kSide, nearest_to_shadow = kSide;
  for (const Vector2d& px : *found) {
    nearest_to_edge = std::min(nearest_to_edge, kView_px - (px - centre).norm());
    nearest_to_shadow = std::min(nearest_to_shadow, (px - shadow).norm() - kShadow_px);
  }
  EXPECT_GE(nearest_to_edge, kTemplate_px);
  EXPECT_LT(nearest_to_shadow, kTemplate_px - 2);
}

// What is dim beside a surround is tissue that has little light, right to where templates reach into the surround.
TEST(FeatureDetector, FindsDimTissueWhereASurroundShowsWhatIsDark) {
  constexpr int kSide = 256;
  constexpr double kView_px = 115, kTemplate_px = PatchTemplate::kReach + 1, kDimmed = 0.1;
  const Vector2d centre(128, 128);
  std::mt19937 random(1);
  test::ImageBuffer image = test::render(test::Texture(3, 15, 6, 60), {}, kSide, kSide, 1.0, random);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      auto& grey = image.at(x, y);
      if (x < kSide / 2) grey = static_cast<std::uint8_t>(std::lround(kDimmed * grey));
      if ((Vector2d(x, y) - centre).norm() > kView_px) grey = 0;
    }
  }
  const DetectorSettings settings = detector_settings_for_trial(image.view(), 600);
  const auto found = find_features(image.view(), {}, settings, 600);
  ASSERT_TRUE(found);
  int dim = 0, lit = 0;
  double nearest_to_edge = kSide;
  for (const Vector2d& px : *found) {
    ++(px.x() < kSide / 2 - kTemplate_px ? dim : lit);
    nearest_to_edge = std::min(nearest_to_edge, kView_px - (px - centre).norm());
  }
  EXPECT_GE(dim, 20) << "beside " << lit;
  EXPECT_GE(nearest_to_edge, kTemplate_px);
  EXPECT_LE(nearest_to_edge, kTemplate_px + 5);
}

}  // namespace
}  // namespace perimap

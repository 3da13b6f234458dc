#include "core/vision/picture_light.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/vision/grey_histogram.hpp"
#include "tests/unit/vision/synthetic_scene.hpp"

namespace perimap {
namespace {

using test::ImageBuffer;

TEST(PictureLight, IsTheMedianOfWhatIsLitAndTheGreyOfAnEvenSurround) {
  std::mt19937 random(2);
  constexpr int kWidth = 321, kHeight = 241;
  ImageBuffer image = test::render(test::Texture(3), test::View{}, kWidth, kHeight, 2, random, 5);
  EXPECT_NEAR(estimate_light(image.view()).lit_grey, 120, 10);
  EXPECT_EQ(estimate_light(image.view()).surround_grey, 0);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (std::hypot(x - 160, y - 120) > 110) image.at(x, y) = static_cast<std::uint8_t>(23 + random() % 4);
    }
  }
  EXPECT_NEAR(estimate_light(image.view()).surround_grey, 24.5, 1);
  EXPECT_NEAR(estimate_light(image.view()).lit_grey, 120, 10);
  EXPECT_EQ(estimate_light(ImageBuffer(40, 30).view()).lit_grey, 0);
}

// Four pixels of 10, eight of 20, four of 200.
ImageBuffer three_greys() {
  ImageBuffer image(4, 4, 3);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) image.at(x, y) = static_cast<std::uint8_t>(y == 0 ? 10 : y == 3 ? 200 : 20);
  }
  return image;
}

TEST(GreyHistogram, AQuantileIsTheLowestGreyThatReachesItsShare) {
  const ImageBuffer image = three_greys();
  const GreyHistogram counts(image.view(), 1);
  EXPECT_EQ(counts.quantile(0.0), 10);
  EXPECT_EQ(counts.quantile(0.25), 10);
  EXPECT_EQ(counts.quantile(0.26), 20);
  EXPECT_EQ(counts.quantile(0.75), 20);
  EXPECT_EQ(counts.quantile(0.76), 200);
  EXPECT_EQ(counts.quantile(1.0), 200);
}

TEST(GreyHistogram, CountsOnlyWhatIsAtLeastAsBrightAsAsked) {
  const ImageBuffer image = three_greys();
  const GreyHistogram counts(image.view(), 1);
  EXPECT_EQ(counts.quantile(0.5, 20), 20);
  EXPECT_EQ(counts.quantile(0.5, 21), 200);
  EXPECT_EQ(counts.quantile(0.5, 201), 0);
  EXPECT_EQ(counts.quantile(0.5, 256), 0);
  EXPECT_EQ(GreyHistogram(GreyImage{}, 1).quantile(0.5), 0);
}

TEST(GreyHistogram, SkipsPixelsByItsStep) {
  const ImageBuffer image = three_greys();
  // Rows and columns 1 and 3: two pixels of 20, two of 200.
  const GreyHistogram counts(image.view(), 2);
  EXPECT_EQ(counts.quantile(0.0), 20);
  EXPECT_EQ(counts.quantile(0.5), 20);
  EXPECT_EQ(counts.quantile(0.51), 200);
}

}  // namespace
}  // namespace perimap

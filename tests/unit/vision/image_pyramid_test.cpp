#include "core/vision/image_pyramid.hpp"

#include <gtest/gtest.h>

#include <random>
#include <tuple>

#include "tests/unit/vision/synthetic_scene.hpp"

namespace perimap {
namespace {

using test::ImageBuffer;

ImageBuffer random_image(int width, int height, int padding, unsigned seed) {
  std::mt19937 random(seed);
  ImageBuffer image(width, height, padding);
  for (std::uint8_t& pixel : image.pixels) pixel = static_cast<std::uint8_t>(random());
  return image;
}

// The definition, pixel by pixel.
int binomial_at(const GreyImage& image, int x, int y) {
  constexpr int kWeights[] = {1, 4, 6, 4, 1};
  int sum = 0;
  for (int j = -2; j <= 2; ++j) {
    for (int i = -2; i <= 2; ++i) {
      const int v = std::clamp(y + j, 0, image.height - 1), u = std::clamp(x + i, 0, image.width - 1);
      sum += kWeights[i + 2] * kWeights[j + 2] * image.row(v)[u];
    }
  }
  return (sum + 128) >> 8;
}

class PyramidOfSize : public testing::TestWithParam<std::tuple<int, int, int>> {};

TEST_P(PyramidOfSize, HoldsTheBinomialBlurOfEvenPixelsAtEachLevel) {
  const auto [width, height, padding] = GetParam();
  const ImageBuffer image = random_image(width, height, padding, 7);
  ImagePyramid pyramid(width, height, 4);
  pyramid.build(image.view());
  for (int l = 1; l < pyramid.levels(); ++l) {
    const GreyImage fine = pyramid.level(l - 1), coarse = pyramid.level(l);
    ASSERT_EQ(coarse.width, (fine.width + 1) / 2);
    ASSERT_EQ(coarse.height, (fine.height + 1) / 2);
    for (int y = 0; y < coarse.height; ++y) {
      for (int x = 0; x < coarse.width; ++x) {
        ASSERT_EQ(coarse.row(y)[x], binomial_at(fine, 2 * x, 2 * y)) << "level " << l << " at " << x << ", " << y;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, PyramidOfSize,
                         testing::Values(std::tuple(64, 48, 0), std::tuple(67, 51, 13), std::tuple(1, 1, 0),
                                         std::tuple(2, 3, 1), std::tuple(5, 1, 0), std::tuple(1, 9, 3),
                                         std::tuple(160, 33, 7)));

TEST(ImagePyramid, BorrowsTheFrameAsLevelZero) {
  const ImageBuffer image = random_image(20, 10, 6, 3);
  ImagePyramid pyramid(20, 10, 2);
  pyramid.build(image.view());
  EXPECT_EQ(pyramid.level(0).data, image.pixels.data());
  EXPECT_EQ(pyramid.level(0).stride, 26);
}

TEST(ImagePyramid, IsEmptyAfterAFrameOfAnotherSize) {
  const ImageBuffer right = random_image(20, 10, 0, 3), wrong = random_image(21, 10, 0, 3);
  ImagePyramid pyramid(20, 10, 3);
  pyramid.build(right.view());
  pyramid.build(wrong.view());
  for (int l = 0; l < 3; ++l) EXPECT_EQ(pyramid.level(l).width, 0);
  pyramid.build(right.view());
  EXPECT_EQ(pyramid.level(0).width, 20);
  pyramid.build({});
  EXPECT_EQ(pyramid.level(0).data, nullptr);
}

}  // namespace
}  // namespace perimap

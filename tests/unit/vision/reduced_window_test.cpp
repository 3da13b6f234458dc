#include "core/vision/reduced_window.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "tests/unit/vision/synthetic_scene.hpp"

namespace perimap {
namespace {

using test::ImageBuffer;

ImageBuffer random_image(int width, int height, int padding) {
  std::mt19937 random(7);
  ImageBuffer image(width, height, padding);
  for (std::uint8_t& pixel : image.pixels) pixel = static_cast<std::uint8_t>(random());
  return image;
}

// The definition, pixel by pixel.
int mean_of_block(const GreyImage& image, int level, int column, int row) {
  const int side = 1 << level;
  int sum = 0;
  for (int y = side * row; y < side * (row + 1); ++y) {
    for (int x = side * column; x < side * (column + 1); ++x) sum += image.row(y)[x];
  }
  return (sum + side * side / 2) / (side * side);
}

TEST(ReducedWindow, HoldsTheMeansOfBlocksOnEveryInstructionSetUpToTheFramesEdges) {
  for (const auto& [width, height, padding] : {std::array{161, 123, 7}, std::array{67, 51, 0}, std::array{9, 5, 3}}) {
    const ImageBuffer image = random_image(width, height, padding);
    for (const SimdTarget target : simd_targets()) {
      for (const int level : {1, 2}) {
        for (const Vector2d& px : {Vector2d(80, 60), Vector2d(0, 0), Vector2d(width, height), Vector2d(4.5, 40)}) {
          const ReducedWindow window(image.view(), level, to_level(px, level), 13.3, patch_kernels(target));
          const GreyImage seen = window.image();
          const int left = static_cast<int>(window.origin().x()), top = static_cast<int>(window.origin().y());
          for (int y = 0; y < seen.height; ++y) {
            for (int x = 0; x < seen.width; ++x) {
              ASSERT_EQ(seen.row(y)[x], mean_of_block(image.view(), level, left + x, top + y));
            }
          }
          EXPECT_LE(left + seen.width, width >> level);
          EXPECT_LE(top + seen.height, height >> level);
        }
      }
    }
  }
}

TEST(ReducedWindow, IsEmptyOutsideTheFrame) {
  const ImageBuffer image = random_image(64, 48, 0);
  const double inf = std::numeric_limits<double>::infinity();
  for (const Vector2d& centre : {Vector2d(-30, 5), Vector2d(5, 1e300), Vector2d(1e300, -1e300), Vector2d(inf, 3)}) {
    const ReducedWindow window(image.view(), 1, centre, 10, patch_kernels(best_simd_target()));
    EXPECT_EQ(window.image().width, 0);
  }
}

TEST(ReducedWindow, MapsPixelsOfALevelToTheMiddlesOfTheirBlocks) {
  EXPECT_EQ(from_level({0, 3}, 1), Vector2d(0.5, 6.5));
  EXPECT_EQ(from_level({1, 2}, 2), Vector2d(5.5, 9.5));
  EXPECT_EQ(to_level(from_level({3.25, 7}, 2), 2), Vector2d(3.25, 7));
}

}  // namespace
}  // namespace perimap

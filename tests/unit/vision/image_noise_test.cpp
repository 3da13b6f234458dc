#include "core/vision/image_noise.hpp"

#include <gtest/gtest.h>

#include "tests/unit/vision/synthetic_scene.hpp"

namespace perimap {
namespace {

using test::ImageBuffer;

TEST(NoiseEstimate, IsTheNoisesDeviationOnTexture) {
  std::mt19937 random(2);
  for (const double sigma : {1.0, 2.0, 4.0}) {
    const ImageBuffer image = test::render(test::Texture(3, 20, 12, 90), test::View{}, 640, 480, sigma, random);
    EXPECT_NEAR(estimate_noise(image.view()), sigma, 0.15 * sigma + 0.1);
  }
  EXPECT_EQ(estimate_noise(ImageBuffer(20, 20).view()), 0);
  EXPECT_EQ(estimate_noise(GreyImage{}), 0);
}

}  // namespace
}  // namespace perimap

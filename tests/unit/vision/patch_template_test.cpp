#include "core/vision/patch_template.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <type_traits>

#include "core/vision/patch_kernels.hpp"
#include "tests/unit/vision/synthetic_scene.hpp"

namespace perimap {
namespace {

using test::ImageBuffer;
using test::render;
using test::Texture;
using test::View;

static_assert(std::is_trivially_copyable_v<PatchTemplate>);

class PatchTemplateTest : public testing::Test {
 protected:
  TemplateVerdict make(const ImageBuffer& image, const Vector2d& px) {
    return make_patch_template(image.view(), px, TemplateSettings{}, patch_kernels(best_simd_target()), patch_);
  }

  std::mt19937 random_{1};
  PatchTemplate patch_;
};

TEST_F(PatchTemplateTest, IsGoodOnTextureAwayFromTheBorder) {
  const ImageBuffer image = render(Texture(1), View{}, 160, 120, 2, random_);
  EXPECT_EQ(make(image, {80, 60}), TemplateVerdict::kGood);
  EXPECT_TRUE(patch_.affine_usable);
  for (const PatchTemplate::Level& level : patch_.levels) EXPECT_TRUE(level.usable);
}

TEST_F(PatchTemplateTest, NeedsTheWindowAndOnePixelAroundItInTheFrame) {
  const ImageBuffer image = render(Texture(1), View{}, 160, 120, 2, random_);
  EXPECT_EQ(make(image, {11, 60}), TemplateVerdict::kGood);
  EXPECT_EQ(make(image, {10.9, 60}), TemplateVerdict::kTooNearBorder);
  EXPECT_EQ(make(image, {148, 108}), TemplateVerdict::kGood);
  EXPECT_EQ(make(image, {148.1, 60}), TemplateVerdict::kTooNearBorder);
  EXPECT_EQ(make(image, {80, 108.1}), TemplateVerdict::kTooNearBorder);
}

TEST_F(PatchTemplateTest, LeavesOutCoarseLevelsThatDoNotFit) {
  const ImageBuffer image = render(Texture(1), View{}, 160, 120, 2, random_);
  ASSERT_EQ(make(image, {17, 60}), TemplateVerdict::kGood);
  EXPECT_TRUE(patch_.levels[1].usable);
  EXPECT_FALSE(patch_.levels[2].usable);
}

TEST_F(PatchTemplateTest, RefusesPlacesThatAreNotNumbers) {
  const ImageBuffer image = render(Texture(1), View{}, 160, 120, 2, random_);
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(make(image, {nan, 60}), TemplateVerdict::kTooNearBorder);
  EXPECT_EQ(make(image, {80, inf}), TemplateVerdict::kTooNearBorder);
  EXPECT_EQ(make(image, {-1e300, 60}), TemplateVerdict::kTooNearBorder);
}

TEST_F(PatchTemplateTest, RefusesNoiseOnAFlatArea) {
  const ImageBuffer image = render(Texture(1, 0), View{}, 160, 120, 2, random_);
  EXPECT_EQ(make(image, {80, 60}), TemplateVerdict::kTooLittleTexture);
}

TEST_F(PatchTemplateTest, RefusesAStraightEdge) {
  ImageBuffer image(160, 120);
  for (int v = 0; v < 120; ++v) {
    for (int u = 0; u < 160; ++u) image.at(u, v) = u < 80 ? 60 : 160;
  }
  EXPECT_EQ(make(image, {80, 60}), TemplateVerdict::kTooLittleTexture);
}

TEST_F(PatchTemplateTest, RefusesAHighlight) {
  ImageBuffer image = render(Texture(1), View{}, 160, 120, 2, random_);
  for (int v = 58; v < 63; ++v) {
    for (int u = 76; u < 80; ++u) image.at(u, v) = 255;
  }
  EXPECT_EQ(make(image, {80, 60}), TemplateVerdict::kSaturated);
}

TEST_F(PatchTemplateTest, RefusesWhatIsNoImage) {
  EXPECT_EQ(make_patch_template(GreyImage{}, {80, 60}, TemplateSettings{}, patch_kernels(best_simd_target()), patch_),
            TemplateVerdict::kTooNearBorder);
}

}  // namespace
}  // namespace perimap

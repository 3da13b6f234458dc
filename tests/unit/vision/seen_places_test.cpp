#include "core/following/seen_places.hpp"

#include <gtest/gtest.h>

#include "tests/unit/vision/synthetic_scene.hpp"

namespace perimap {
namespace {

constexpr int kWidth = 320, kHeight = 240;

Thumbnail seen(const Vector2d& shift, double gain, unsigned scene = 3) {
  std::mt19937 random(1);
  const test::Texture texture(scene, 22, 20, 200);
  return thumbnail_of(test::render(texture, test::View{.t = shift, .gain = gain}, kWidth, kHeight, 2, random).view());
}

TEST(SeenPlaces, AreFoundDisplacedAndInAnotherLight) {
  for (const Vector2d& shift : {Vector2d(0, 0), Vector2d(60, -30), Vector2d(-45, 50)}) {
    const auto displacement = displacement_between(seen({0, 0}, 1), seen(shift, 0.7));
    ASSERT_TRUE(displacement) << shift.transpose();
    EXPECT_LT((*displacement - shift).norm(), kWidth / Thumbnail::kSide) << displacement->transpose();
  }
}

TEST(SeenPlaces, AreNotFoundInAnotherScene) { EXPECT_FALSE(displacement_between(seen({0, 0}, 1), seen({0, 0}, 1, 8))); }

TEST(SeenPlaces, OfAnotherSizeAreOther) {
  const test::ImageBuffer other(100, 100);
  EXPECT_FALSE(displacement_between(seen({0, 0}, 1), thumbnail_of(other.view())));
}

TEST(SeenPlaces, AreNumberedAnewWhenThereAreTooMany) {
  SeenPlaces places;
  for (int i = 0; i < 2 * SeenPlaces::kMost; ++i) EXPECT_EQ(places.remember(Thumbnail{}), i % SeenPlaces::kMost);
}

}  // namespace
}  // namespace perimap

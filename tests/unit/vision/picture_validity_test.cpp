#include "core/following/picture_validity.hpp"

#include <gtest/gtest.h>

#include "tests/unit/vision/synthetic_scene.hpp"

namespace perimap {
namespace {

constexpr int kWidth = 320, kHeight = 240;

// Tissue, of which the left half can be made something else.
struct Validity : ::testing::Test {
  test::Texture texture{3, 15, 6, 60};
  std::mt19937 random{1};
  test::ImageBuffer tissue = test::render(texture, {}, kWidth, kHeight, 1.5, random);
  PictureValidity validity{FrameRate(25)};

  Validity() {
    for (int i = 0; i < 25; ++i) validity.look_at(tissue.view());
  }
  template <class Change>
  RegionFault left_half(Change change) {
    test::ImageBuffer image = tissue;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth / 2; ++x) image.at(x, y) = static_cast<std::uint8_t>(change(image.at(x, y)));
    }
    validity.look_at(image.view());
    EXPECT_EQ(validity.at({3 * kWidth / 4.0, kHeight / 2.0}), RegionFault::kNone) << "the other half is as it was";
    return validity.at({kWidth / 4.0, kHeight / 2.0});
  }
};

TEST_F(Validity, IsEverywhereOfTissue) {
  EXPECT_EQ(validity.share_of(RegionFault::kNone), 1);
  EXPECT_EQ(validity.at({-50, 1e9}), RegionFault::kNone);
}

TEST_F(Validity, NamesWhyARegionShowsNone) {
  EXPECT_EQ(left_half([](int) { return 2; }), RegionFault::kDark);
  EXPECT_EQ(left_half([](int) { return 254; }), RegionFault::kGlare);
  EXPECT_EQ(left_half([](int grey) { return 0.2 * grey + 0.8 * 190; }), RegionFault::kVeiled);
  EXPECT_EQ(left_half([](int grey) { return 25 + 0.1 * grey; }), RegionFault::kStained);
  EXPECT_EQ(left_half([](int grey) { return 120 + 0.1 * (grey - 120); }), RegionFault::kBlurred);
  EXPECT_NEAR(validity.share_of(RegionFault::kBlurred), 0.5, 0.01);
  EXPECT_EQ(left_half([](int grey) { return grey; }), RegionFault::kNone);
}

TEST_F(Validity, IsNoMatterOfExposure) {
  EXPECT_EQ(left_half([](int grey) { return std::min(255, 3 * grey / 2); }), RegionFault::kNone);
  EXPECT_EQ(left_half([](int grey) { return 2 * grey / 3; }), RegionFault::kNone);
}

TEST_F(Validity, TakesWhatIsSeenForLongAsUsual) {
  RegionFault fault = RegionFault::kNone;
  for (int i = 0; i < 25 * 180; ++i) fault = left_half([](int grey) { return 120 + 0.1 * (grey - 120); });
  EXPECT_EQ(fault, RegionFault::kNone);
}

}  // namespace
}  // namespace perimap

#include "core/pipeline/picture_loop.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace perimap {
namespace {

using std::chrono::milliseconds;

struct Loop : ::testing::Test {
  static constexpr int kWidth = 321, kHeight = 240;

  PictureLoop loop;
  int frames = 0;

  // Noise alone, another one for each number.
  static std::vector<std::uint8_t> picture(unsigned number) {
    std::mt19937 generator(number);
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(kWidth) * kHeight);
    for (std::uint8_t& pixel : pixels) pixel = static_cast<std::uint8_t>(generator() >> 28U);
    return pixels;
  }
  bool seen(const std::vector<std::uint8_t>& pixels) {
    return loop.seen_before({pixels.data(), kWidth, kHeight, kWidth}, Instant(milliseconds(33 * ++frames)));
  }
};

TEST_F(Loop, PicturesOfASensorNeverComeAgain) {
  for (unsigned i = 0; i < 200; ++i) ASSERT_FALSE(seen(picture(i))) << i;
}

TEST_F(Loop, EachPictureOfALoopHasComeBefore) {
  for (unsigned i = 0; i < 60; ++i) ASSERT_FALSE(seen(picture(i)));
  for (unsigned i = 0; i < 120; ++i) ASSERT_TRUE(seen(picture(i % 60))) << i;
  EXPECT_FALSE(seen(picture(1000)));
}

TEST_F(Loop, APixelThatDiffersInARowThatIsLookedAtMakesAnotherPicture) {
  std::vector<std::uint8_t> pixels = picture(7);
  ASSERT_FALSE(seen(pixels));
  pixels[kWidth - 1] ^= 1U;
  EXPECT_FALSE(seen(pixels));
}

TEST_F(Loop, WhatCameLongerAgoIsForgotten) {
  ASSERT_FALSE(seen(picture(7)));
  frames += 700;
  EXPECT_FALSE(seen(picture(7)));
}

TEST_F(Loop, ALensThatIsCoveredRepeatsNothing) {
  const std::vector<std::uint8_t> black(static_cast<std::size_t>(kWidth) * kHeight, 16);
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(seen(black));
  EXPECT_FALSE(loop.seen_before({}, Instant(milliseconds(5000))));
}

}  // namespace
}  // namespace perimap

#include "drivers/image/colour_reducer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <utility>
#include <vector>

#include "tests/unit/camera/made_jpeg.hpp"

namespace perimap {
namespace {

struct Yuv {
  int y, u, v;
};
// ITU-R BT.601, limited range: full red, and a middle grey.
constexpr Yuv kRed{81, 90, 240}, kGrey{126, 128, 128};

// Red on the left of `edge`, which is even, in the rows above kLower; all else is grey.
class Picture {
 public:
  static constexpr int kLower = 8;

  Picture(PixelFormat format, int width, int height, int edge, std::size_t padding) {
    const auto colour = [&](int x, int y) { return x < edge && y < kLower ? kRed : kGrey; };
    frame_.format = format;
    frame_.width = width;
    frame_.height = height;
    frame_.stride = row_bytes(format, width) + padding;
    bytes_.resize(picture_bytes(format, height, frame_.stride));
    const auto put = [&](std::size_t row, std::size_t at, int value) {
      bytes_.at(row * frame_.stride + at) = static_cast<std::byte>(value);
    };
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
      for (int x = 0; x < width; ++x) {
        const auto at = static_cast<std::size_t>(x);
        const Yuv c = colour(x, static_cast<int>(y));
        if (format == PixelFormat::kGrey) put(y, at, c.y);
        if (format == PixelFormat::kNv12) {
          put(y, at, c.y);
          put(static_cast<std::size_t>(height) + y / 2, at, x % 2 == 0 ? c.u : c.v);
          if (x % 2 == 0) put(static_cast<std::size_t>(height) + y / 2, at + 1, c.v);
        }
        if (format == PixelFormat::kYuyv || format == PixelFormat::kUyvy) {
          const std::size_t luma = format == PixelFormat::kYuyv ? 0 : 1;
          put(y, 2 * at + luma, c.y);
          put(y, 2 * at + 1 - luma, x % 2 == 0 ? c.u : c.v);
          if (x % 2 == 0) put(y, 2 * at + 3 - luma, c.v);
        }
      }
    }
    frame_.bytes = bytes_;
  }
  [[nodiscard]] const CameraFrame& frame() const noexcept { return frame_; }

 private:
  CameraFrame frame_;
  std::vector<std::byte> bytes_;
};

std::array<int, 3> bgr_at(const ColourImage& image, int x, int y) {
  const std::uint8_t* const p = image.row(y) + static_cast<std::ptrdiff_t>(3) * x;
  return {p[0], p[1], p[2]};
}

void expect_near(const std::array<int, 3>& bgr, const std::array<int, 3>& expected) {
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(bgr[i], expected[i], 3) << "channel " << i;
}

TEST(ColourReducer, GivesTheColoursOfEachFormatAtAQuarterOfTheSize) {
  for (const PixelFormat format : {PixelFormat::kYuyv, PixelFormat::kUyvy, PixelFormat::kNv12}) {
    for (const auto& [width, height] : {std::pair{32, 16}, std::pair{33, 17}, std::pair{30, 15}, std::pair{29, 2}}) {
      SCOPED_TRACE(testing::Message() << pixel_format_name(format) << " " << width << "x" << height);
      const Picture picture(format, width, height, 16, 6);
      ColourReducer reducer;
      reducer.reduce_colour(picture.frame());
      const ColourImage& colour = reducer.picture();
      ASSERT_NE(colour.bgr, nullptr);
      ASSERT_EQ(colour.width, (width + 3) / 4);
      ASSERT_EQ(colour.height, (height + 3) / 4);
      for (int y = 0; y < colour.height; ++y) {
        for (int x = 0; x < colour.width; ++x) {
          const bool red = x < 4 && y < Picture::kLower / 4;
          expect_near(bgr_at(colour, x, y), red ? std::array{0, 0, 255} : std::array{128, 128, 128});
        }
      }
    }
  }
}

TEST(ColourReducer, ReducesThePictureThatAGreyFrameWasMadeOf) {
  constexpr int kWidth = 30, kHeight = 18;
  std::vector<std::uint8_t> bgr;
  for (int i = 0; i < kWidth * kHeight; ++i) {
    for (const int value : i % kWidth < 16 ? std::array{10, 20, 200} : std::array{90, 80, 70}) {
      bgr.push_back(static_cast<std::uint8_t>(value));
    }
  }
  const std::vector<std::byte> grey(static_cast<std::size_t>(kWidth) * kHeight);
  CameraFrame frame;
  frame.width = kWidth;
  frame.height = kHeight;
  frame.stride = kWidth;
  frame.bytes = grey;
  frame.colour = {bgr.data(), kWidth, kHeight, std::ptrdiff_t{3} * kWidth};
  ColourReducer reducer(Duration(0));
  reducer.reduce_colour(frame);
  ASSERT_NE(reducer.picture().bgr, nullptr);
  EXPECT_EQ(reducer.picture().width, 8);
  EXPECT_EQ(reducer.picture().height, 5);
  for (int y = 0; y < 5; ++y) {
    expect_near(bgr_at(reducer.picture(), 3, y), {10, 20, 200});
    expect_near(bgr_at(reducer.picture(), 7, y), {90, 80, 70});
  }
  frame.colour.width = kWidth - 1;
  reducer.reduce_colour(frame);
  EXPECT_EQ(reducer.picture().bgr, nullptr) << "it is of another picture";
}

TEST(ColourReducer, GivesTheColoursOfAJpeg) {
  constexpr int kWidth = 50, kHeight = 34;
  CameraFrame frame;
  frame.format = PixelFormat::kMjpg;
  frame.width = kWidth;
  frame.height = kHeight;
  // Chroma 90 in both channels, luma 100: JFIF's full range.
  const auto jpeg =
      test::make_jpeg(kWidth, kHeight, [](int, int y) { return static_cast<std::uint8_t>(y < 16 ? 40 : 100); });
  frame.bytes = jpeg;
  ColourReducer reducer(Duration(0));
  reducer.reduce_colour(frame);
  ASSERT_NE(reducer.picture().bgr, nullptr);
  EXPECT_EQ(reducer.picture().width, 13);
  EXPECT_EQ(reducer.picture().height, 9);
  expect_near(bgr_at(reducer.picture(), 6, 7), {33, 140, 47});
  expect_near(bgr_at(reducer.picture(), 6, 1), {0, 80, 0});
  frame.bytes = std::span(jpeg).first(jpeg.size() / 2);
  reducer.reduce_colour(frame);
  EXPECT_EQ(reducer.picture().bgr, nullptr);
  const auto grey = test::make_jpeg(
      kWidth, kHeight, [](int, int) { return std::uint8_t{100}; }, false);
  frame.bytes = grey;
  reducer.reduce_colour(frame);
  EXPECT_EQ(reducer.picture().bgr, nullptr);
}

TEST(ColourReducer, HasNoneOfGreyFramesOrOfThoseThatDoNotHoldTheirPicture) {
  ColourReducer reducer(Duration(0));
  reducer.reduce_colour(Picture(PixelFormat::kGrey, 32, 16, 16, 0).frame());
  EXPECT_EQ(reducer.picture().bgr, nullptr);
  for (const PixelFormat format : {PixelFormat::kYuyv, PixelFormat::kUyvy, PixelFormat::kNv12}) {
    const Picture picture(format, 32, 16, 16, 0);
    CameraFrame frame = picture.frame();
    reducer.reduce_colour(frame);
    EXPECT_NE(reducer.picture().bgr, nullptr);
    frame.bytes = frame.bytes.first(frame.bytes.size() - 1);
    reducer.reduce_colour(frame);
    EXPECT_EQ(reducer.picture().bgr, nullptr);
  }
}

TEST(ColourReducer, LooksAtTheFirstFrameAndThenAtOneInATenthOfASecondAtAnyFrameRate) {
  const Picture picture(PixelFormat::kYuyv, 32, 16, 16, 0);
  for (const auto& [rate_per_s, every] : {std::pair{10.0, 1}, std::pair{20.0, 2}, std::pair{30.0, 3},
                                          std::pair{60.0, 6}, std::pair{120.0, 12}, std::pair{240.0, 24}}) {
    SCOPED_TRACE(testing::Message() << rate_per_s << " frames/s");
    ColourReducer reducer;
    std::vector<int> seen;
    // The rate is known once some intervals are.
    const int known = 3 * every + 30;
    for (int i = 0; i < known + 5 * every; ++i) {
      CameraFrame frame = picture.frame();
      frame.stamp.capture = from_ns(5'000'000'000) + from_seconds(i / rate_per_s);
      reducer.reduce_colour(frame);
      const bool looked_at = reducer.picture().bgr != nullptr;
      if (i == 0) {
        EXPECT_TRUE(looked_at);
      }
      if (looked_at && i >= known) seen.push_back(i);
    }
    ASSERT_EQ(seen.size(), 5U);
    for (std::size_t i = 1; i < seen.size(); ++i) EXPECT_EQ(seen[i] - seen[i - 1], every);
  }
}

}  // namespace
}  // namespace perimap

#include "drivers/image/grey_converter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <numeric>
#include <string>

#include "tests/unit/camera/made_jpeg.hpp"

namespace perimap {
namespace {

using ::testing::HasSubstr;

std::vector<std::byte> bytes_of(std::initializer_list<int> values) {
  std::vector<std::byte> bytes;
  for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

CameraFrame frame(PixelFormat format, int width, int height, std::size_t stride, std::span<const std::byte> bytes) {
  CameraFrame f;
  f.format = format;
  f.width = width;
  f.height = height;
  f.stride = stride;
  f.bytes = bytes;
  return f;
}

std::vector<int> pixels(const GreyImage& image) {
  std::vector<int> all;
  for (int y = 0; y < image.height; ++y) all.insert(all.end(), image.row(y), image.row(y) + image.width);
  return all;
}

TEST(PixelFormat, HasANameThatLeadsBack) {
  for (const auto format :
       {PixelFormat::kGrey, PixelFormat::kYuyv, PixelFormat::kUyvy, PixelFormat::kNv12, PixelFormat::kMjpg}) {
    EXPECT_EQ(pixel_format_of_name(pixel_format_name(format)), format);
  }
  EXPECT_FALSE(pixel_format_of_name("rgb8"));
}

TEST(GreyConverter, TakesTheLumaOfEachFormatWhateverFollowsARow) {
  struct Case {
    PixelFormat format;
    std::size_t stride;
    std::vector<std::byte> bytes;  // 4 x 2 pixels of luma 1 to 8; chroma 90 and more, 0 behind the rows
  };
  const Case cases[] = {
      {PixelFormat::kGrey, 4, bytes_of({1, 2, 3, 4, 5, 6, 7, 8})},
      {PixelFormat::kGrey, 6, bytes_of({1, 2, 3, 4, 0, 0, 5, 6, 7, 8, 0, 0})},
      {PixelFormat::kYuyv, 8, bytes_of({1, 90, 2, 91, 3, 92, 4, 93, 5, 94, 6, 95, 7, 96, 8, 97})},
      {PixelFormat::kYuyv, 10, bytes_of({1, 90, 2, 91, 3, 92, 4, 93, 0, 0, 5, 94, 6, 95, 7, 96, 8, 97, 0, 0})},
      {PixelFormat::kUyvy, 8, bytes_of({90, 1, 91, 2, 92, 3, 93, 4, 94, 5, 95, 6, 96, 7, 97, 8})},
      {PixelFormat::kNv12, 4, bytes_of({1, 2, 3, 4, 5, 6, 7, 8, 90, 91, 92, 93})},
      {PixelFormat::kNv12, 5, bytes_of({1, 2, 3, 4, 0, 5, 6, 7, 8, 0, 90, 91, 92, 93, 0})},
  };
  GreyConverter converter;
  for (const Case& c : cases) {
    const auto image = converter.convert(frame(c.format, 4, 2, c.stride, c.bytes));
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_THAT(pixels(*image), ::testing::ElementsAre(1, 2, 3, 4, 5, 6, 7, 8)) << pixel_format_name(c.format);
  }
}

TEST(GreyConverter, TakesAnOddWidth) {
  GreyConverter converter;
  const auto bytes = bytes_of({1, 90, 2, 91, 3, 92, 0, 93});
  EXPECT_THAT(pixels(converter.convert(frame(PixelFormat::kYuyv, 3, 1, 8, bytes)).value()),
              ::testing::ElementsAre(1, 2, 3));
}

TEST(GreyConverter, RefusesBytesThatDoNotHoldThePicture) {
  const std::vector<std::byte> bytes(64);
  GreyConverter converter;
  struct Case {
    PixelFormat format;
    int width, height;
    std::size_t stride, size;
  };
  for (const Case& c :
       {Case{PixelFormat::kGrey, 8, 8, 8, 63}, Case{PixelFormat::kGrey, 8, 8, 7, 64},
        Case{PixelFormat::kYuyv, 8, 4, 16, 63}, Case{PixelFormat::kYuyv, 8, 4, 8, 64},
        Case{PixelFormat::kNv12, 8, 6, 8, 64}, Case{PixelFormat::kUyvy, 0, 4, 16, 64},
        Case{PixelFormat::kGrey, 8, -1, 8, 64}, Case{PixelFormat::kGrey, 1 << 20, 1 << 20, 1U << 20U, 64},
        Case{PixelFormat::kGrey, 8, 2, ~std::size_t{0} / 2 + 1, 64}, Case{PixelFormat::kMjpg, 8, 8, 0, 0},
        Case{PixelFormat::kMjpg, 8, 8, 0, 64}}) {
    const auto image = converter.convert(frame(c.format, c.width, c.height, c.stride, std::span(bytes).first(c.size)));
    EXPECT_FALSE(image) << pixel_format_name(c.format) << " " << c.width << "x" << c.height << " stride " << c.stride;
  }
}

class Jpeg : public ::testing::Test {
 protected:
  static constexpr int kWidth = 50, kHeight = 34;
  static std::uint8_t luma(int x, int y) { return static_cast<std::uint8_t>(20 + 3 * x + 2 * y); }

  std::string error_of(std::span<const std::byte> jpeg, int width = kWidth, int height = kHeight) {
    const auto image = converter_.convert(frame(PixelFormat::kMjpg, width, height, 0, jpeg));
    return image ? "decoded" : image.error().message;
  }

  GreyConverter converter_;
};

TEST_F(Jpeg, IsDecodedToItsLuma) {
  const auto jpeg = test::make_jpeg(kWidth, kHeight, &luma);
  for (const auto& bytes : {jpeg, test::without_tables(jpeg), test::make_jpeg(kWidth, kHeight, &luma, false)}) {
    const auto image = converter_.convert(frame(PixelFormat::kMjpg, kWidth, kHeight, 0, bytes));
    ASSERT_TRUE(image) << image.error().message;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) ASSERT_NEAR(image->row(y)[x], luma(x, y), 4) << x << ", " << y;
    }
  }
}

TEST_F(Jpeg, MayBePaddedAsCamerasDo) {
  auto jpeg = test::make_jpeg(kWidth, kHeight, &luma);
  jpeg.insert(jpeg.end(), 300, std::byte{0});
  EXPECT_EQ(error_of(jpeg), "decoded");
}

TEST_F(Jpeg, CutShortAnywhereIsNoPicture) {
  const auto jpeg = test::make_jpeg(kWidth, kHeight, &luma);
  // Without its end marker alone it is still whole.
  for (std::size_t length = 0; length + 2 < jpeg.size(); length += 7) {
    EXPECT_NE(error_of(std::span(jpeg).first(length)), "decoded") << length;
  }
  EXPECT_NE(error_of(std::span(jpeg).first(jpeg.size() - 3)), "decoded");
  EXPECT_EQ(error_of(std::span(jpeg).first(jpeg.size() - 2)), "decoded");
  EXPECT_EQ(error_of(jpeg), "decoded");
}

// Where each restart marker begins.
std::vector<std::size_t> restarts_of(const std::vector<std::byte>& jpeg) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i + 1 < jpeg.size(); ++i) {
    if (jpeg[i] == std::byte{0xFF} && (jpeg[i + 1] & std::byte{0xF8}) == std::byte{0xD0}) found.push_back(i);
  }
  return found;
}

TEST_F(Jpeg, MayHaveBytesBeforeARestartAsWebcamsDo) {
  const auto jpeg = test::make_jpeg(kWidth, kHeight, &luma, true, false, 2);
  const auto restarts = restarts_of(jpeg);
  ASSERT_GT(restarts.size(), 3U);
  const auto plain = converter_.convert(frame(PixelFormat::kMjpg, kWidth, kHeight, 0, jpeg));
  ASSERT_TRUE(plain);
  const std::vector<std::uint8_t> expected(plain->data, plain->data + kWidth * kHeight);
  for (const std::size_t count : {1U, 2U, 5U}) {
    auto padded = jpeg;
    for (auto at = restarts.rbegin(); at != restarts.rend(); ++at) {
      padded.insert(padded.begin() + static_cast<std::ptrdiff_t>(*at), count, std::byte{0});
    }
    const auto image = converter_.convert(frame(PixelFormat::kMjpg, kWidth, kHeight, 0, padded));
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_TRUE(std::equal(expected.begin(), expected.end(), image->data)) << count;
  }
}

TEST_F(Jpeg, OfWebcamsThatWereRefusedOnceAreTheSamePicture) {
  const auto file = [](const char* name) {
    std::ifstream stream(std::string(PERIMAP_TEST_DATA "/refused_once/") + name, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(stream)), {});
    const auto bytes = std::as_bytes(std::span(text));
    return std::vector<std::byte>(bytes.begin(), bytes.end());
  };
  constexpr int kWide = 640, kHigh = 480;
  const auto decoded = [&](const char* name) {
    const auto bytes = file(name);
    const auto image = converter_.convert(frame(PixelFormat::kMjpg, kWide, kHigh, 0, bytes));
    EXPECT_TRUE(image) << name << ": " << image.error().message;
    return image ? pixels(*image) : std::vector<int>();
  };
  const std::vector<int> plain = decoded("j_plain.jpg");
  ASSERT_EQ(plain.size(), static_cast<std::size_t>(kWide * kHigh));
  EXPECT_EQ(decoded("j_rst_extra1.jpg"), plain);
  EXPECT_EQ(decoded("j_noeoi.jpg"), plain);
}

TEST_F(Jpeg, OfWhichARestartIntervalIsMissingIsNoPicture) {
  const auto jpeg = test::make_jpeg(kWidth, kHeight, &luma, true, false, 2);
  const auto restarts = restarts_of(jpeg);
  auto without = jpeg;
  without.erase(without.begin() + static_cast<std::ptrdiff_t>(restarts[1]),
                without.begin() + static_cast<std::ptrdiff_t>(restarts[2]));
  EXPECT_NE(error_of(without), "decoded");
  for (const std::size_t at : restarts) EXPECT_NE(error_of(std::span(jpeg).first(at)), "decoded") << at;
}

TEST_F(Jpeg, OfAnotherSizeOrKindIsRefused) {
  const auto jpeg = test::make_jpeg(kWidth, kHeight, &luma);
  EXPECT_THAT(error_of(jpeg, kWidth + 1), HasSubstr("another size"));
  EXPECT_THAT(error_of(test::make_jpeg(kWidth, kHeight, &luma, true, true)), HasSubstr("progressive"));
}

TEST_F(Jpeg, GarbledGivesAnErrorOrAPictureAndNothingElse) {
  const auto jpeg = test::make_jpeg(kWidth, kHeight, &luma);
  std::srand(1);
  for (int i = 0; i < 2000; ++i) {
    auto garbled = jpeg;
    for (int k = 0; k < 3; ++k) {
      garbled[static_cast<std::size_t>(std::rand()) % garbled.size()] = static_cast<std::byte>(std::rand());
    }
    (void)error_of(garbled);
  }
  EXPECT_EQ(error_of(jpeg), "decoded");  // nothing is left of what failed
}

}  // namespace
}  // namespace perimap

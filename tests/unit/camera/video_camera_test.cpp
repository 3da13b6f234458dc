#include "drivers/camera/video_camera.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "drivers/video/video_file.hpp"

namespace perimap {
namespace {

constexpr int kFrames = 6;

// In the test's working folder, which is a build folder.
class VideoCamera : public ::testing::Test {
 protected:
  VideoCamera() {
    const std::vector<std::uint8_t> pixels(std::size_t{64} * 48, 100);
    auto writer = VideoWriter::create(file_, 64, 48, 200.0).value();
    for (int i = 0; i < kFrames; ++i) {
      EXPECT_TRUE(writer->write({0, {}, {pixels.data(), 64, 48, 64}}, {}));
    }
    EXPECT_TRUE(writer->finish());
  }
  ~VideoCamera() override { std::filesystem::remove(file_); }
  VideoCamera(const VideoCamera&) = delete;
  VideoCamera& operator=(const VideoCamera&) = delete;

  std::string file_ = std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + ".avi";
  DeviceHealth health_;
  Interrupt interrupt_;
  std::vector<FrameStamp> stamps_;
};

TEST_F(VideoCamera, GivesItsFramesAtItsOwnPaceAndEnds) {
  const CameraSink sink = [this](const CameraFrame& frame) {
    stamps_.push_back(frame.stamp);
    EXPECT_EQ(frame.width, 64);
    EXPECT_EQ(frame.height, 48);
  };
  const auto played = serve_video_camera({file_, 20.0, false}, sink, health_, interrupt_);
  ASSERT_TRUE(played) << played.error().message;
  ASSERT_EQ(stamps_.size() + health_.lost.get(), static_cast<std::size_t>(kFrames));
  for (std::size_t i = 0; i < stamps_.size(); ++i) {
    EXPECT_LE(stamps_[i].capture, stamps_[i].arrival);
    if (i == 0) continue;
    const auto steps = static_cast<std::int64_t>(stamps_[i].sequence - stamps_[i - 1].sequence);
    EXPECT_EQ(stamps_[i].capture - stamps_[i - 1].capture, steps * std::chrono::milliseconds(50));
  }
  EXPECT_EQ(health_.reason(), "the video has ended");
}

TEST_F(VideoCamera, BeginsAnewWithOneCount) {
  const CameraSink sink = [this](const CameraFrame& frame) {
    stamps_.push_back(frame.stamp);
    if (frame.stamp.sequence > 2 * kFrames) interrupt_.request();
  };
  ASSERT_TRUE(serve_video_camera({file_, 0.0, true}, sink, health_, interrupt_));
  ASSERT_FALSE(stamps_.empty());
  for (std::size_t i = 1; i < stamps_.size(); ++i) EXPECT_GT(stamps_[i].sequence, stamps_[i - 1].sequence);
  EXPECT_EQ(stamps_.back().sequence, stamps_.size() + health_.lost.get());
}

TEST_F(VideoCamera, RefusesFramesOfAnotherSizeThanTheCalibrations) {
  const auto played = serve_video_camera(
      {file_, 0.0, true, 64, 32}, [](const CameraFrame&) {}, health_, interrupt_);
  ASSERT_FALSE(played);
  EXPECT_THAT(played.error().message, ::testing::HasSubstr("frames of 64x48, the calibration is for 64x32"));
}

TEST_F(VideoCamera, SaysWhichFileItCannotRead) {
  const auto played = serve_video_camera(
      {"none.avi", 0.0, true}, [](const CameraFrame&) {}, health_, interrupt_);
  ASSERT_FALSE(played);
  EXPECT_THAT(played.error().message, ::testing::HasSubstr("none.avi"));
  EXPECT_EQ(health_.state(), DeviceState::kClosed);
}

TEST(VideoReader, ReadsOnBehindABrokenSpotAndKeepsTheFramesNumbers) {
  constexpr std::uint64_t kMany = 12;
  const std::string file = "broken.mov";
  auto writer = VideoWriter::create(file, 64, 48, 30.0).value();
  std::mt19937 random(1);
  std::vector<std::uint8_t> pixels(std::size_t{64} * 48);
  for (std::uint64_t i = 0; i < kMany; ++i) {
    for (std::uint8_t& pixel : pixels) pixel = static_cast<std::uint8_t>(random() % 256);
    ASSERT_TRUE(writer->write({i, {}, {pixels.data(), 64, 48, 64}}, {}));
  }
  ASSERT_TRUE(writer->finish());
  const auto bytes = static_cast<std::streamoff>(std::filesystem::file_size(file));
  std::fstream(file, std::ios::in | std::ios::out | std::ios::binary).seekp(bytes * 3 / 10)
      << std::string(static_cast<std::size_t>(bytes / 5), '\0');

  auto reader = VideoReader::open(file).value();
  std::vector<std::uint64_t> numbers;
  for (auto frame = reader->next(); frame.has_value() && *frame != nullptr; frame = reader->next()) {
    numbers.push_back((*frame)->number);
  }
  std::filesystem::remove(file);
  ASSERT_GE(numbers.size(), 6U);
  EXPECT_LT(numbers.size(), kMany);
  EXPECT_EQ(numbers.front(), 0U);
  EXPECT_EQ(numbers.back(), kMany - 1);
  EXPECT_TRUE(std::is_sorted(numbers.begin(), numbers.end(), std::less_equal<>()));
}

TEST(VideoReader, TellsAFolderFromAFileThatIsNotThere) {
  const auto folder = VideoReader::open(".");
  ASSERT_FALSE(folder);
  EXPECT_THAT(folder.error().message, ::testing::HasSubstr("a folder"));
  const auto none = VideoReader::open("none.avi");
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, ::testing::HasSubstr("there is no such file"));
}

}  // namespace
}  // namespace perimap

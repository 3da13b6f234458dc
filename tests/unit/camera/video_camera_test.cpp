#include "drivers/camera/video_camera.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "drivers/video/video_file.hpp"

namespace perimap {
namespace {

constexpr int kFrames = 6;

// The blocks of a Matroska file (RFC 8794, RFC 9559), found by the sizes that its elements tell.
class Matroska {
 public:
  explicit Matroska(const std::string& file) : file_(file) {
    std::ifstream in(file, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(in), {});
    walk(0, bytes_.size());
  }
  [[nodiscard]] std::size_t blocks() const { return blocks_.size(); }
  // Each block's time in its cluster.
  void retime(const std::vector<int>& ms) {
    for (std::size_t i = 0; i < blocks_.size() && i < ms.size(); ++i) {
      bytes_[blocks_[i]] = static_cast<char>(ms[i] >> 8);
      bytes_[blocks_[i] + 1] = static_cast<char>(ms[i] & 0xFF);
    }
    std::ofstream(file_, std::ios::binary).write(bytes_.data(), static_cast<std::streamsize>(bytes_.size()));
  }

 private:
  std::uint64_t number(std::size_t& at, bool keep_marker) const {
    const auto first = static_cast<unsigned char>(bytes_.at(at));
    const int length = std::countl_zero(first) + 1;
    std::uint64_t value = keep_marker ? first : first & (0xFFU >> static_cast<unsigned>(length));
    for (int i = 1; i < length; ++i) {
      value = value << 8U | static_cast<unsigned char>(bytes_.at(at + static_cast<std::size_t>(i)));
    }
    at += static_cast<std::size_t>(length);
    return value;
  }
  void walk(std::size_t at, std::size_t end) {
    constexpr std::uint64_t kSegment = 0x18538067, kCluster = 0x1F43B675, kSimpleBlock = 0xA3;
    while (at < end) {
      const std::uint64_t id = number(at, true);
      const std::uint64_t size = number(at, false);
      const std::size_t next = std::min<std::size_t>(end, at + size);
      if (id == kSegment || id == kCluster) walk(at, next);
      if (id == kSimpleBlock) blocks_.push_back(at + 1);  // behind the track's number
      at = next;
    }
  }

  std::string file_;
  std::vector<char> bytes_;
  std::vector<std::size_t> blocks_;
};

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

// As a capture program writes them that leaves out what has not changed.
TEST_F(VideoCamera, FramesHaveTheTimesThatTheFileGivesThem) {
  const std::string file = "FramesHaveTheTimes.mkv";
  const std::vector<std::uint8_t> pixels(std::size_t{64} * 48, 100);
  auto writer = VideoWriter::create(file, 64, 48, 20.0).value();
  for (int i = 0; i < kFrames; ++i) ASSERT_TRUE(writer->write({0, {}, {pixels.data(), 64, 48, 64}}, {}));
  ASSERT_TRUE(writer->finish());
  // Two that the file has rounded to one time are half of the way to the next apart.
  const std::vector<int> written_ms{0, 67, 83, 150, 150, 250};
  const std::vector<int> times_ms{0, 67, 83, 150, 200, 250};
  Matroska matroska(file);
  ASSERT_EQ(matroska.blocks(), times_ms.size());
  matroska.retime(written_ms);
  const CameraSink sink = [this](const CameraFrame& frame) { stamps_.push_back(frame.stamp); };
  for (const double rate_hz : {0.0, 50.0}) {
    stamps_.clear();
    const auto played = serve_video_camera({file, rate_hz, false}, sink, health_, interrupt_);
    ASSERT_TRUE(played) << played.error().message;
    ASSERT_GE(stamps_.size(), 2U);
    for (std::size_t i = 1; i < stamps_.size(); ++i) {
      const std::size_t at = stamps_[i].sequence - 1;
      const std::size_t before = stamps_[i - 1].sequence - 1;
      const auto passed = stamps_[i].capture - stamps_[i - 1].capture;
      if (rate_hz > 0.0) {
        EXPECT_EQ(passed, static_cast<std::int64_t>(at - before) * std::chrono::milliseconds(20));
      } else {
        EXPECT_NEAR(to_seconds(passed), 1e-3 * (times_ms.at(at) - times_ms.at(before)), 1e-6);
      }
    }
  }
  std::filesystem::remove(file);
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

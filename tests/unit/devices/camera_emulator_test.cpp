#include "drivers/standins/emulator/camera_emulator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <filesystem>
#include <thread>
#include <vector>

#include "drivers/recording/sensor_writer.hpp"
#include "drivers/standins/emulator/played_session.hpp"
#include "drivers/standins/emulator/recorded_frames.hpp"
#include "drivers/standins/emulator/simulated_frames.hpp"
#include "drivers/standins/emulator/video_output.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct Shown {
  std::vector<std::uint8_t> bytes;  // those that are used
  Instant stamp;
  Instant when;
};

// What a video output does with its buffers (Linux Media userspace API, Part I): those queued are shown in order, and
// may be taken back then.
struct FakeOutput {
  std::uint32_t capabilities = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING;
  std::vector<std::uint32_t> formats{V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_YUYV};
  std::uint32_t widest = 64;
  std::uint32_t padding = 0;  // bytes at the end of a row
  bool stuck = false;         // shows nothing
  int queue_error = 0;

  std::vector<Shown> shown;
  int openings = 0, streams_on = 0, streams_off = 0, mapped = 0, unmapped = 0;
  std::vector<std::string> misuse;
};

class FakeOutputNode final : public V4l2Node {
 public:
  explicit FakeOutputNode(FakeOutput& output) : output_(output) { ++output_.openings; }

  int control(unsigned long request, void* argument) override {
    switch (request) {
      case VIDIOC_QUERYCAP: {
        auto& c = *static_cast<v4l2_capability*>(argument);
        c.capabilities = c.device_caps = output_.capabilities | V4L2_CAP_DEVICE_CAPS;
        return 0;
      }
      case VIDIOC_G_FMT:
        return 0;
      case VIDIOC_S_FMT: {
        v4l2_pix_format& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
        if (std::find(output_.formats.begin(), output_.formats.end(), pix.pixelformat) == output_.formats.end()) {
          pix.pixelformat = output_.formats.at(0);
        }
        pix.width = std::min(pix.width, output_.widest);
        pix.bytesperline = (pix.pixelformat == V4L2_PIX_FMT_YUYV ? 2 : 1) * pix.width + output_.padding;
        pix.sizeimage = pix.bytesperline * pix.height;
        bytes_ = pix.sizeimage;
        return 0;
      }
      case VIDIOC_REQBUFS: {
        auto& r = *static_cast<v4l2_requestbuffers*>(argument);
        r.count = std::min(r.count, 3U);
        memory_.assign(r.count, std::vector<std::byte>(bytes_));
        return 0;
      }
      case VIDIOC_QUERYBUF: {
        auto& b = *static_cast<v4l2_buffer*>(argument);
        b.length = bytes_;
        b.m.offset = b.index * 4096;
        return 0;
      }
      case VIDIOC_QBUF:
        return queue(*static_cast<v4l2_buffer*>(argument));
      case VIDIOC_DQBUF: {
        if (!streaming_) return refuse("taken back while not streaming");
        if (output_.stuck || queued_.empty()) return EAGAIN;
        static_cast<v4l2_buffer*>(argument)->index = queued_.front();
        queued_.pop_front();
        return 0;
      }
      case VIDIOC_STREAMON:
        streaming_ = true;
        ++output_.streams_on;
        return 0;
      case VIDIOC_STREAMOFF:
        ++output_.streams_off;
        return 0;
      default:
        return ENOTTY;
    }
  }

  std::span<std::byte> map(std::size_t length, std::int64_t offset) override {
    ++output_.mapped;
    return std::span(memory_.at(static_cast<std::size_t>(offset) / 4096)).first(length);
  }
  void unmap(std::span<std::byte> /*memory*/) noexcept override { ++output_.unmapped; }
  Ready wait(Duration /*longest*/, const Interrupt& /*interrupt*/) override { return Ready::kNothing; }

 private:
  int queue(const v4l2_buffer& b) {
    if (output_.queue_error != 0) return output_.queue_error;
    if (b.index >= memory_.size() || std::find(queued_.begin(), queued_.end(), b.index) != queued_.end()) {
      return refuse("a buffer queued twice");
    }
    if (b.type != V4L2_BUF_TYPE_VIDEO_OUTPUT || b.bytesused == 0 || b.bytesused > bytes_) return refuse("not a frame");
    queued_.push_back(b.index);
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(memory_[b.index].data());
    output_.shown.push_back({{bytes, bytes + b.bytesused},
                             from_ns(b.timestamp.tv_sec * 1'000'000'000 + b.timestamp.tv_usec * 1000),
                             MonotonicClock::now()});
    return 0;
  }
  int refuse(const char* what) {
    output_.misuse.emplace_back(what);
    return EINVAL;
  }

  FakeOutput& output_;
  std::uint32_t bytes_ = 0;
  std::vector<std::vector<std::byte>> memory_;
  std::deque<std::uint32_t> queued_;
  bool streaming_ = false;
};

TEST(VideoOutput, TakesYuyvWhereThereIsNoGreyAndKeepsTheRowsOfTheOutput) {
  FakeOutput fake;
  fake.formats = {V4L2_PIX_FMT_YUYV};
  fake.padding = 3;
  const std::vector<std::uint8_t> pixels{1, 2, 3, 4};
  auto output = VideoOutput::open(std::make_unique<FakeOutputNode>(fake), "/dev/video9", 2, 2);
  ASSERT_TRUE(output) << output.error().message;
  ASSERT_TRUE((*output)->show({pixels.data(), 2, 2, 2}, from_ns(5'000'007'000)));
  ASSERT_EQ(fake.shown.size(), 1U);
  EXPECT_THAT(fake.shown[0].bytes, ElementsAre(1, 128, 2, 128, 0, 0, 0, 3, 128, 4, 128, 0, 0, 0));
  EXPECT_EQ(fake.shown[0].stamp, from_ns(5'000'007'000));
}

TEST(VideoOutput, LeavesOutAFrameWhileTheOnesBeforeAreNotShown) {
  FakeOutput fake;
  fake.stuck = true;
  const std::vector<std::uint8_t> pixels(4);
  auto output = VideoOutput::open(std::make_unique<FakeOutputNode>(fake), "/dev/video9", 2, 2).value();
  const GreyImage image{pixels.data(), 2, 2, 2};
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(output->show(image, from_ns(1)).value());
  EXPECT_FALSE(output->show(image, from_ns(2)).value());
  fake.stuck = false;
  EXPECT_TRUE(output->show(image, from_ns(3)).value());
  EXPECT_THAT(fake.misuse, ElementsAre());
}

TEST(VideoOutput, RefusesWhatIsNoOutputOrTakesOtherFrames) {
  const auto refusal = [](const FakeOutput& fake) {
    FakeOutput copy = fake;
    const auto output = VideoOutput::open(std::make_unique<FakeOutputNode>(copy), "/dev/video9", 80, 48);
    return output ? std::string("accepted") : output.error().message;
  };
  FakeOutput camera;
  camera.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  EXPECT_EQ(refusal(camera), "/dev/video9: not a video output; v4l2loopback makes one");
  EXPECT_EQ(refusal({}), "/dev/video9: takes 64x48 instead of the frames' 80x48");
  FakeOutput coloured;
  coloured.formats = {V4L2_PIX_FMT_RGB24};
  EXPECT_EQ(refusal(coloured), "/dev/video9: takes neither GREY nor YUYV");
}

// Ten frames, 20 ms apart, each filled with its number; they arrive 5 ms after their capture.
class CameraEmulator : public ::testing::Test {
 protected:
  static constexpr int kWidth = 8, kHeight = 6, kFrames = 10;
  static constexpr Duration kPeriod = milliseconds(20), kTransport = milliseconds(5);
  static constexpr Instant kFirstCapture{std::chrono::seconds(100)};

  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "perimap-camera-XXXXXX").string();
    folder_ = mkdtemp(name.data());
    recording_ = (folder_ / "frames.mcap").string();
    auto writer = SensorWriter::create(recording_, {}, kFirstCapture).value();
    for (int i = 0; i < kFrames; ++i) {
      const std::vector<std::byte> pixels(std::size_t{kWidth} * kHeight, static_cast<std::byte>(i));
      CameraFrame frame;
      frame.stamp.sequence = static_cast<std::uint64_t>(i);
      frame.stamp.capture = kFirstCapture + i * kPeriod;
      frame.width = kWidth;
      frame.stride = kWidth;
      frame.height = kHeight;
      frame.bytes = pixels;
      ASSERT_TRUE(writer.write(frame, frame.stamp.capture + kTransport));
    }
    ASSERT_TRUE(writer.finish());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // Long enough ahead that all is ready by then.
  Expected<ShownFrames> play(const EmulatorFaults& faults = {}, Duration from_now = milliseconds(700)) {
    auto frames = RecordedFrames::open(recording_);
    if (!frames) return tl::unexpected(std::move(frames.error()));
    return show(*frames, faults, from_now);
  }
  Expected<ShownFrames> show(PlayedFrames& frames, const EmulatorFaults& faults, Duration from_now) {
    start_ = MonotonicClock::now() + from_now;
    Interrupt interrupt;
    const V4l2Opener open = [this](const std::string& path) -> Expected<std::unique_ptr<V4l2Node>> {
      EXPECT_EQ(path, "/dev/video9");
      return std::make_unique<FakeOutputNode>(fake_);
    };
    return emulate_camera(
        "/dev/video9", frames, start_, faults, [this](const std::string& where) { where_ = where; }, interrupt, open);
  }
  [[nodiscard]] std::vector<int> numbers() const {
    std::vector<int> all;
    for (const Shown& frame : fake_.shown) all.push_back(frame.bytes.at(0));
    return all;
  }

  std::filesystem::path folder_;
  std::string recording_;
  FakeOutput fake_;
  Instant start_;
  std::string where_;
};

TEST_F(CameraEmulator, ShowsEveryFrameNotBeforeItsTimeAndWithTheStampOfItsCapture) {
  const auto played = play();
  ASSERT_TRUE(played) << played.error().message;
  EXPECT_EQ(played->shown, static_cast<std::uint64_t>(kFrames));
  EXPECT_THAT(numbers(), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
  for (int i = 0; i < kFrames; ++i) {
    const Shown& frame = fake_.shown[static_cast<std::size_t>(i)];
    EXPECT_EQ(frame.bytes.size(), std::size_t{kWidth} * kHeight);
    EXPECT_GE(frame.when, start_ + i * kPeriod) << i;
    // Microseconds are all that a buffer's stamp holds.
    EXPECT_LT(start_ + i * kPeriod - kTransport - frame.stamp, std::chrono::microseconds(1)) << i;
    EXPECT_GE(start_ + i * kPeriod - kTransport, frame.stamp) << i;
  }
  EXPECT_EQ(where_, "v4l2:/dev/video9, mono8 8x6");
  EXPECT_EQ(fake_.streams_on, 1);
  EXPECT_EQ(fake_.streams_off, 1);
  EXPECT_EQ(fake_.mapped, fake_.unmapped);
  EXPECT_THAT(fake_.misuse, ElementsAre());
}

TEST_F(CameraEmulator, WhatWasBeforeItBeganIsGone) {
  const auto played = play({}, milliseconds(-90));
  ASSERT_TRUE(played) << played.error().message;
  EXPECT_EQ(played->shown, fake_.shown.size());
  EXPECT_LE(played->shown, 5U) << "the first five were over by then";
  int next = kFrames - static_cast<int>(played->shown);
  for (const int number : numbers()) EXPECT_EQ(number, next++) << "what was still to come has come";
}

TEST_F(CameraEmulator, LosesAndCutsFramesOnRequest) {
  EmulatorFaults faults;
  faults.lost = 0.4;
  faults.truncated = 0.5;
  const auto played = play(faults);
  ASSERT_TRUE(played) << played.error().message;
  EXPECT_GT(played->lost, 0U);
  EXPECT_GT(played->faulty, 0U);
  EXPECT_EQ(played->shown + played->lost, static_cast<std::uint64_t>(kFrames));
  EXPECT_EQ(fake_.shown.size(), played->shown);
  std::uint64_t cut = 0;
  for (const Shown& frame : fake_.shown) cut += frame.bytes.size() < std::size_t{kWidth} * kHeight ? 1 : 0;
  EXPECT_EQ(cut, played->faulty);
}

TEST_F(CameraEmulator, UnpluggedClosesTheOutputAndOpensItAgain) {
  EmulatorFaults faults;
  faults.unplug_every = milliseconds(70);
  faults.unplug_for = milliseconds(50);
  const auto played = play(faults);
  ASSERT_TRUE(played) << played.error().message;
  EXPECT_THAT(numbers(), ElementsAre(0, 1, 2, 3, 6, 7, 8, 9));
  EXPECT_EQ(fake_.openings, 2);
  EXPECT_EQ(fake_.streams_off, 2);
}

TEST_F(CameraEmulator, SaysWhyTheOutputTakesNoFrame) {
  fake_.queue_error = ENODEV;
  const auto played = play();
  ASSERT_FALSE(played);
  EXPECT_EQ(played.error().message, "/dev/video9: the device has gone");
}

// Frames that take their time to be made, as rendered ones do.
class SlowFrames final : public PlayedFrames {
 public:
  SlowFrames(Duration period, Duration making) : period_(period), making_(making) {}
  [[nodiscard]] Instant first_arrival() const noexcept override { return Instant(); }
  Expected<std::optional<PlayedFrame>> next(Instant now) override {
    while (number_ < kFrames && arrival() < now + making_) {
      ++number_;
      ++left_out_;
    }
    if (number_ == kFrames) return std::optional<PlayedFrame>();
    std::this_thread::sleep_for(making_);
    pixels_.assign(pixels_.size(), static_cast<std::uint8_t>(number_));
    const Instant t = arrival();
    ++number_;
    return PlayedFrame{t, t, {pixels_.data(), 8, 6, 8}};
  }
  [[nodiscard]] std::uint64_t left_out() const noexcept override { return left_out_; }
  static constexpr int kFrames = 40;

 private:
  [[nodiscard]] Instant arrival() const { return Instant() + number_ * period_; }

  Duration period_, making_;
  int number_ = 0;
  std::uint64_t left_out_ = 0;
  std::vector<std::uint8_t> pixels_ = std::vector<std::uint8_t>(48);
};

TEST_F(CameraEmulator, FramesThatAreMadeTooSlowlyAreLeftOutAndCountedAndTheOthersComeInTime) {
  SlowFrames frames(milliseconds(10), milliseconds(25));
  const auto played = show(frames, {}, milliseconds(100));
  ASSERT_TRUE(played) << played.error().message;
  EXPECT_GT(played->shown, 0U);
  EXPECT_GE(played->too_slow, played->shown) << "25 ms are more than two periods";
  EXPECT_EQ(played->shown + played->too_slow, static_cast<std::uint64_t>(SlowFrames::kFrames));
  for (const Shown& frame : fake_.shown) EXPECT_GE(frame.when, start_ + frame.bytes.at(0) * milliseconds(10));
}

// The simulated heart as `perimap emulate camera` shows it, and the tracker and ECG that go with it.
TEST_F(CameraEmulator, ShowsASimulatedHeartFrameByFrameInStepWithItsSensors) {
  SimulationSettings settings;
  settings.width = settings.height = 64;
  settings.frames_per_s = 10.0;
  settings.duration = std::chrono::seconds(1);
  settings.respiration_channel = true;
  const auto simulation = Simulation::create(settings);
  ASSERT_TRUE(simulation) << simulation.error().message;
  SimulatedFrames frames(*simulation);
  fake_.widest = 64;
  const auto played = show(frames, {}, milliseconds(500));
  ASSERT_TRUE(played) << played.error().message;
  ASSERT_EQ(played->shown + played->too_slow, 10U);
  ASSERT_GT(played->shown, 0U);
  RenderWorkspace workspace;
  std::vector<std::uint8_t> expected(std::size_t{64} * 64);
  const Duration offset = start_ - simulation->arrivals().front().arrival;
  for (const Shown& shown : fake_.shown) {
    // A buffer's stamp holds microseconds.
    const auto frame = std::find_if(simulation->frames().begin(), simulation->frames().end(), [&](const auto& f) {
      return std::chrono::abs(f.stamp.capture + offset - shown.stamp) <= std::chrono::microseconds(1);
    });
    ASSERT_NE(frame, simulation->frames().end()) << "a stamp that no frame has";
    EXPECT_GE(shown.when, frame->stamp.arrival + offset);
    simulation->render(static_cast<std::size_t>(frame - simulation->frames().begin()), workspace, expected);
    EXPECT_EQ(shown.bytes, expected);
  }
  const PlayedSession session = PlayedSession::of(*simulation, {});
  const PoseTrack poses = session.poses(start_);
  EXPECT_EQ(poses.start(), simulation->tracker_sample(0, {}).source_time + offset);
  const EcgDeviceSignals signals = session.ecg_device(start_);
  const EcgBlock& block = simulation->ecg().front();
  EXPECT_FLOAT_EQ(signals.ecg_mV.at(block.first_sample_time + offset).value(), block.mV[0]);
  EXPECT_TRUE(signals.respiration);
}

TEST_F(CameraEmulator, NamesARecordingThatIsNone) {
  recording_ = "/nowhere.mcap";
  const auto played = play();
  ASSERT_FALSE(played);
  EXPECT_THAT(played.error().message, HasSubstr("/nowhere.mcap"));
}

}  // namespace
}  // namespace perimap

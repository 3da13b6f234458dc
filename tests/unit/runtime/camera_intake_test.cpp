#include "daemon/runtime/camera_intake.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <vector>

#include "counted_allocations.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr int kWidth = 32, kHeight = 16;

class CameraInto : public ::testing::Test {
 protected:
  // Sequence numbers count periods of 20 ms; yuyv with chroma 200 and luma 100.
  [[nodiscard]] CameraFrame frame(std::uint64_t sequence, Duration late = {}) const {
    CameraFrame f;
    f.format = PixelFormat::kYuyv;
    f.width = kWidth;
    f.height = kHeight;
    f.stride = row_bytes(f.format, kWidth);
    f.bytes = bytes_;
    const Instant capture = Instant(milliseconds(1000)) + static_cast<int>(sequence) * milliseconds(20) + late;
    f.stamp = {sequence, capture, capture + milliseconds(5)};
    return f;
  }
  // Whether the pipeline gets it with colour; nothing when it does not get it.
  std::optional<bool> coloured(const CameraFrame& given) {
    static_cast<void>(camera_.deliver_frame(given));
    FrameHandle handle;
    if (!entrance_->pop_frame(handle)) return std::nullopt;
    EXPECT_EQ(entrance_->image(handle).row(3)[5], 100);
    const bool any = entrance_->colour(handle).bgr != nullptr;
    entrance_->give_back(handle);
    return any;
  }

  PipelineCounters counters_;
  std::unique_ptr<SensorEntrance> entrance_ =
      std::make_unique<SensorEntrance>(kWidth, kHeight, EcgIntakeSettings{}, BreathDetectorSettings{}, counters_);
  SensorIntake intake_{entrance_.get(), nullptr};
  CameraIntake camera_{intake_};
  std::vector<std::byte> bytes_ = [] {
    std::vector<std::byte> bytes(std::size_t{2} * kWidth * kHeight, std::byte{100});
    for (std::size_t i = 1; i < bytes.size(); i += 2) bytes[i] = std::byte{200};
    return bytes;
  }();
};

TEST_F(CameraInto, AFramesColourGoesWithTheNextOneAndTheFirstOnesWithBoth) {
  std::vector<bool> seen;
  for (std::uint64_t i = 0; i < 8; ++i) seen.push_back(coloured(frame(i)).value());
  // Frames 0, 3 and 6 are looked at.
  EXPECT_EQ(seen, (std::vector<bool>{true, true, false, false, true, false, false, true}));
}

TEST_F(CameraInto, ColourIsKeptOverLostFramesAndNotOverAnInterruption) {
  for (std::uint64_t i = 0; i < 4; ++i) static_cast<void>(coloured(frame(i)));
  EXPECT_EQ(coloured(frame(5)), true) << "frame 4 is missing";
  for (std::uint64_t i = 6; i < 8; ++i) static_cast<void>(coloured(frame(i)));
  EXPECT_EQ(coloured(frame(8, milliseconds(300))), false) << "the camera was gone";
}

TEST_F(CameraInto, FramesThatLackEverySecondOneStillHaveColour) {
  int with_colour = 0;
  for (std::uint64_t i = 0; i < 12; ++i) with_colour += coloured(frame(2 * i)).value() ? 1 : 0;
  EXPECT_EQ(with_colour, 5);
}

TEST_F(CameraInto, AFrameThatCanNotBeDecodedIsAGapAndTakesNoColourAway) {
  for (std::uint64_t i = 0; i < 4; ++i) static_cast<void>(coloured(frame(i)));
  CameraFrame damaged = frame(4);
  damaged.format = PixelFormat::kMjpg;
  EXPECT_FALSE(camera_.deliver_frame(damaged));
  FrameHandle nothing;
  EXPECT_FALSE(entrance_->pop_frame(nothing));
  EXPECT_EQ(coloured(frame(5)), true);
}

TEST_F(CameraInto, FramesTakeNothingFromTheHeapOnceThereIsRoom) {
  camera_.reserve(kWidth, kHeight);
  bool all = true;
  EXPECT_EQ(test::allocations_of([&] {
              for (std::uint64_t i = 0; i < 4; ++i) all = camera_.deliver_frame(frame(i)) && all;
            }),
            0);
  EXPECT_TRUE(all);
}

TEST_F(CameraInto, GreyFramesHaveNone) {
  for (std::uint64_t i = 0; i < 8; ++i) {
    CameraFrame grey = frame(i);
    grey.format = PixelFormat::kGrey;
    grey.bytes = std::span(bytes_).first(std::size_t{2} * kWidth * kHeight);
    std::fill(bytes_.begin(), bytes_.end(), std::byte{100});
    EXPECT_EQ(coloured(grey), false);
  }
}

}  // namespace
}  // namespace perimap

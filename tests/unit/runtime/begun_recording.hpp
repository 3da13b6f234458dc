// A recording of devices that has begun.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include "core/time/instant.hpp"
#include "daemon/runtime/session_recorder.hpp"

namespace perimap {

// In a folder of its own, which goes with it. It holds one frame: a recording without any does not replay.
class BegunRecording {
 public:
  BegunRecording() { EXPECT_NE(mkdtemp(folder_.data()), nullptr); }
  ~BegunRecording() { std::filesystem::remove_all(folder_); }
  BegunRecording(const BegunRecording&) = delete;
  BegunRecording& operator=(const BegunRecording&) = delete;

  // Null, and said, when it cannot be made.
  [[nodiscard]] std::unique_ptr<SessionRecorder> begin(const SensorRecordingFacts& facts) const {
    auto recorder = SessionRecorder::create(file(), facts, std::size_t{1} << 20U);
    if (!recorder) {
      ADD_FAILURE() << recorder.error().message;
      return nullptr;
    }
    constexpr std::array<std::byte, 16> kPixels{};
    CameraFrame frame;
    frame.stamp = {1, MonotonicClock::now(), MonotonicClock::now()};
    frame.width = frame.height = 4;
    frame.stride = 4;
    frame.bytes = kPixels;
    (*recorder)->frame(frame);
    return std::move(*recorder);
  }

  [[nodiscard]] const std::string& folder() const noexcept { return folder_; }
  [[nodiscard]] std::string file() const { return folder_ + "/session.mcap"; }

 private:
  std::string folder_ = (std::filesystem::temp_directory_path() / "perimap-recording-XXXXXX").string();
};

}  // namespace perimap

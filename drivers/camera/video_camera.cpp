#include "drivers/camera/video_camera.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>

#include "drivers/video/video_file.hpp"

namespace perimap {
namespace {

constexpr double kUsualRate_hz = 30.0;
// A time that is farther on is a damaged one: nobody waits for its frame.
constexpr double kLongestVideo_s = 1e6;
constexpr Duration kLongestStep = std::chrono::seconds(60);

class Playing {
 public:
  Playing(const VideoCameraSettings& settings, const CameraSink& sink, DeviceHealth& health, const Interrupt& interrupt)
      : settings_(settings), sink_(sink), health_(health), interrupt_(interrupt) {}

  Expected<void> run() {
    for (bool again = true; again && !interrupt_.requested(); again = settings_.loop) {
      auto reader = VideoReader::open(settings_.file);
      if (!reader) return tl::unexpected(std::move(reader.error()));
      begin(**reader);
      if (auto played = play(**reader); !played) return played;
    }
    return {};
  }

 private:
  void begin(const VideoReader& reader) {
    if (period_ > Duration(0)) return;
    double rate_hz = settings_.frame_rate_hz > 0.0 ? settings_.frame_rate_hz : reader.frames_per_s();
    if (rate_hz <= 0.0) rate_hz = kUsualRate_hz;
    period_ = from_seconds(1.0 / rate_hz);
    by_rate_ = settings_.frame_rate_hz > 0.0;
    capture_ = MonotonicClock::now();
    health_.openings.add();
    health_.set_identity(settings_.file);
  }

  Expected<void> play(VideoReader& reader) {
    std::uint64_t expected = 0;
    const Instant first = capture_ + period_;
    while (!interrupt_.requested()) {
      auto decoded = reader.next();
      if (!decoded) return tl::unexpected(std::move(decoded.error()));
      if (*decoded == nullptr) return {};
      const GreyImage& grey = (*decoded)->grey;
      if (settings_.width > 0 && (grey.width != settings_.width || grey.height != settings_.height)) {
        return fail(fmt::format("{}: frames of {}x{}, the calibration is for {}x{}", settings_.file, grey.width,
                                grey.height, settings_.width, settings_.height));
      }
      const std::uint64_t undecoded = (*decoded)->number - expected;
      expected = (*decoded)->number + 1;
      sequence_ += undecoded + 1;
      const Instant by_rate = capture_ + static_cast<std::int64_t>(undecoded + 1) * period_;
      const auto& time_s = (*decoded)->time_s;
      const bool told = time_s && *time_s < kLongestVideo_s;
      const Instant as_told = told ? first + from_seconds(*time_s) : by_rate;
      // A rate that was asked for is in the place of the file's own times, and so is the usual one where it tells none.
      capture_ = by_rate_ || as_told <= capture_ || as_told - capture_ > kLongestStep ? by_rate : as_told;
      if (undecoded > 0) health_.lost.add(undecoded);
      const Duration ahead = capture_ - MonotonicClock::now();
      if (ahead < -period_) {
        health_.lost.add();
        continue;
      }
      if (ahead > Duration(0) && !wait_unless_interrupted(ahead, interrupt_)) return {};
      deliver(**decoded);
    }
    return {};
  }

  void deliver(const VideoFrame& decoded) {
    const GreyImage& grey = decoded.grey;
    CameraFrame frame;
    frame.colour = decoded.colour;
    frame.stamp = {sequence_, capture_, std::max(capture_, MonotonicClock::now())};
    frame.width = grey.width;
    frame.height = grey.height;
    frame.stride = static_cast<std::size_t>(grey.stride);
    frame.bytes = std::as_bytes(std::span(grey.data, frame.stride * static_cast<std::size_t>(grey.height)));
    health_.samples.add();
    health_.jitter.add(frame.stamp.arrival - capture_);
    sink_(frame);
    health_.set_state(DeviceState::kStreaming);
  }

  const VideoCameraSettings& settings_;
  const CameraSink& sink_;
  DeviceHealth& health_;
  const Interrupt& interrupt_;
  Duration period_{0};
  bool by_rate_ = false;
  Instant capture_{};
  std::uint64_t sequence_ = 0;
};

}  // namespace

Expected<void> serve_video_camera(const VideoCameraSettings& settings, const CameraSink& sink, DeviceHealth& health,
                                  const Interrupt& interrupt) {
  health.set_state(DeviceState::kStarting);
  auto played = Playing(settings, sink, health, interrupt).run();
  health.set_reason(played ? "the video has ended" : played.error().message);
  health.set_state(DeviceState::kClosed);
  return played;
}

}  // namespace perimap

// One opening of a V4L2 camera: settled with the driver, its buffers mapped, streaming until it is destroyed.
//
// Linux Media Infrastructure userspace API, Part I: querying capabilities, data format negotiation, streaming I/O
// (memory mapping), DV timings, controls, events. Single-planar video capture, which UVC cameras and the usual SDI and
// HDMI cards have.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/camera/v4l2_node.hpp"
#include "drivers/image/camera_frame.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

struct V4l2Settings {
  std::string path;
  std::optional<PixelFormat> format;  // none: the first that the camera has at no much lower rate, raw colour first
  int width = 0;                      // 0, 0: what the camera is set to
  int height = 0;
  int input = -1;              // of a card with several; -1: what it is set to
  double frame_rate_hz = 0.0;  // 0: what it is set to
  double exposure_ms = 0.0;    // 0: what it is set to, automatic or not
  double gain = -1.0;          // in the camera's own steps; -1: what it is set to
  Duration delay{0};           // of the picture when it is stamped: scope processor, capture card
};

// What a driver's stamp tells of a frame.
enum class StampSource : std::uint8_t { kStartOfExposure, kEndOfFrame };

// The instant of mid-exposure. The stamp at the end of a frame is that of its last pixel, a readout after the
// exposure's end; a camera that runs at its full rate takes a frame's period to read out.
[[nodiscard]] constexpr Instant mid_exposure(Instant stamp, StampSource source, Duration exposure, Duration period,
                                             Duration delay) noexcept {
  return stamp - delay + (source == StampSource::kStartOfExposure ? exposure / 2 : -period - exposure / 2);
}

class V4l2Stream {
 public:
  enum class Grab : std::uint8_t {
    kFrame,        // frame() has it
    kDamaged,      // one came that is no picture: the driver's error flag, too few bytes, a stamp off the clock
    kNothing,      // none came in time
    kInterrupted,  // by the interrupt
  };

  // Fails when the node is no camera, or does not give the format and size that were asked for: those belong to the
  // calibration. The error names what it gives instead.
  [[nodiscard]] static Expected<std::unique_ptr<V4l2Stream>> open(std::unique_ptr<V4l2Node> node,
                                                                  const V4l2Settings& settings);
  V4l2Stream(const V4l2Stream&) = delete;
  V4l2Stream& operator=(const V4l2Stream&) = delete;
  ~V4l2Stream();

  // Gives the buffer of the frame before back to the driver, and waits for the next. An error says that the device has
  // gone or stopped.
  [[nodiscard]] Expected<Grab> next(Duration longest, const Interrupt& interrupt);
  // Valid until the next call of next(). Its sequence is the driver's own, which begins anew with each opening.
  [[nodiscard]] const CameraFrame& frame() const noexcept { return frame_; }

  // Card, driver, format, size, rate.
  [[nodiscard]] const std::string& identity() const noexcept { return identity_; }
  // 0 when the driver does not tell.
  [[nodiscard]] Duration period() const noexcept { return period_; }
  // Why a frame was damaged, last.
  [[nodiscard]] const char* damage() const noexcept { return damage_; }
  // What the driver says of the input, when it is not well: no power, no signal.
  [[nodiscard]] std::string input_fault();

 private:
  V4l2Stream(std::unique_ptr<V4l2Node> node, const V4l2Settings& settings);

  [[nodiscard]] Expected<void> settle();
  [[nodiscard]] Expected<void> settle_input();
  [[nodiscard]] Expected<void> settle_format();
  [[nodiscard]] Expected<void> settle_rate();
  [[nodiscard]] Expected<void> settle_controls();
  [[nodiscard]] Expected<void> start();
  [[nodiscard]] Expected<void> set_control(std::uint32_t id, std::int32_t value, const char* key);
  [[nodiscard]] std::optional<std::int32_t> control(std::uint32_t id);
  [[nodiscard]] std::string offered_formats();
  [[nodiscard]] std::string offered_sizes(std::uint32_t fourcc);
  // The most frames/s that the driver says it has of such pictures; 0 when it does not say.
  [[nodiscard]] double fastest_hz(std::uint32_t fourcc, std::uint32_t width, std::uint32_t height);
  [[nodiscard]] tl::unexpected<Error> refuse(const std::string& what) const;
  [[nodiscard]] tl::unexpected<Error> refuse(const std::string& what, int error) const;
  [[nodiscard]] Expected<void> give_back();
  [[nodiscard]] Expected<Grab> dequeue_buffer();

  std::unique_ptr<V4l2Node> node_;
  V4l2Settings settings_;
  std::string identity_;
  std::vector<std::span<std::byte>> buffers_;
  std::optional<std::uint32_t> held_;  // buffer of frame_
  bool streaming_ = false;
  CameraFrame frame_;
  std::size_t needed_bytes_ = 1;
  Duration period_{0};
  Duration exposure_{0};
  bool exposure_known_ = false;
  const char* damage_ = "";
};

}  // namespace perimap

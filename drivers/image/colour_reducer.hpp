// A frame's colour, as coarse as it is enough to tell instruments from tissue.
#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include "core/sensors/colour_image.hpp"
#include "core/sensors/measured_frame_rate.hpp"
#include "core/time/instant.hpp"
#include "drivers/image/camera_frame.hpp"
#include "drivers/image/jpeg_decoder.hpp"

namespace perimap {

class ColourReducer {
 public:
  // Of a frame in so long, by the rate measured from the frames' stamps of capture, beginning with the first: an
  // instrument moves slowly, and a JPEG has to be decoded again. 0: of each frame.
  static constexpr Duration kUsualInterval = std::chrono::milliseconds(100);
  explicit ColourReducer(Duration interval = kUsualInterval) : interval_(interval) {}

  // Makes room, so that frames of up to this size allocate nothing; kMjpg excepted, where libjpeg does.
  void reserve(int width, int height);

  void reduce_colour(const CameraFrame& frame);

  // Of the last frame, reduced as colour_image.hpp says; without pixels when it was passed over, has no colour,
  // or is damaged. Valid until the next one.
  [[nodiscard]] const ColourImage& picture() const noexcept { return picture_; }

 private:
  [[nodiscard]] bool reduce(const CameraFrame& frame);

  Duration interval_;
  MeasuredFrameRate rate_;
  std::uint64_t passed_over_ = 0;  // since the last one that was looked at
  bool any_ = false;
  std::vector<std::uint8_t> bgr_;
  JpegDecoder jpeg_;
  ColourImage picture_;
};

}  // namespace perimap

// A frame's colour, as coarse as it is enough to tell instruments from tissue.
#pragma once

#include <cstdint>
#include <vector>

#include "core/sensors/colour_image.hpp"
#include "drivers/image/camera_frame.hpp"
#include "drivers/image/jpeg_decoder.hpp"

namespace perimap {

class ColourReducer {
 public:
  // Of every so manieth frame, beginning with the first: an instrument moves slowly, and a JPEG has to be decoded
  // again.
  static constexpr int kUsualInterval = 3;
  explicit ColourReducer(int interval_frames = kUsualInterval) : interval_(interval_frames) {}

  // Makes room, so that frames of up to this size allocate nothing; kMjpg excepted, where libjpeg does.
  void reserve(int width, int height);

  void reduce_colour(const CameraFrame& frame);

  // Of the last frame, reduced as colour_image.hpp says; without pixels when it was passed over, has no colour,
  // or is damaged. Valid until the next one.
  [[nodiscard]] const ColourImage& picture() const noexcept { return picture_; }

 private:
  [[nodiscard]] bool reduce(const CameraFrame& frame);

  int interval_;
  int passed_over_ = 0;  // since the last one that was looked at
  bool any_ = false;
  std::vector<std::uint8_t> bgr_;
  JpegDecoder jpeg_;
  ColourImage picture_;
};

}  // namespace perimap

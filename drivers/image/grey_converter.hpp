// A camera's frame in grey, as the pipeline takes it.
#pragma once

#include <cstdint>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/grey_image.hpp"
#include "drivers/image/camera_frame.hpp"
#include "drivers/image/jpeg_decoder.hpp"

namespace perimap {

// Grey is the luma as it stands in the frame: full or limited range, which no match of patches minds.
class GreyConverter {
 public:
  // Makes room, so that frames of up to this size allocate nothing; kMjpg excepted, where libjpeg does.
  void reserve(int width, int height);

  // Borrows the frame's own bytes where the luma lies by itself, this converter's otherwise, until its next call. Fails
  // when the bytes do not hold the picture that the frame announces, or are no JPEG that can be decoded.
  [[nodiscard]] Expected<GreyImage> convert(const CameraFrame& frame);

 private:
  std::vector<std::uint8_t> grey_;
  JpegDecoder jpeg_;
};

}  // namespace perimap

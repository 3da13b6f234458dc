#include "drivers/image/camera_frame.hpp"

#include <fmt/format.h>

namespace perimap {

Expected<void> check_bytes(const CameraFrame& frame) {
  constexpr int kLargestSide = 16384;
  if (frame.width <= 0 || frame.height <= 0 || frame.width > kLargestSide || frame.height > kLargestSide) {
    return fail(fmt::format("a frame of {} x {} pixels", frame.width, frame.height));
  }
  if (frame.format != PixelFormat::kMjpg &&
      (frame.stride < row_bytes(frame.format, frame.width) ||
       frame.stride > (std::size_t{1} << 32U) ||  // so that the next product holds
       frame.bytes.size() < picture_bytes(frame.format, frame.height, frame.stride))) {
    return fail(fmt::format("{} x {} pixels of {} with {} bytes a row do not fit {} bytes", frame.width, frame.height,
                            pixel_format_name(frame.format), frame.stride, frame.bytes.size()));
  }
  return {};
}

}  // namespace perimap

// A frame as the camera gave it.
#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "core/error/expected.hpp"
#include "core/sensors/colour_image.hpp"
#include "core/sensors/frame_stamp.hpp"
#include "drivers/image/pixel_format.hpp"

namespace perimap {

// The bytes are borrowed: from the kernel, a file's reader or a message.
struct CameraFrame {
  FrameStamp stamp;
  PixelFormat format = PixelFormat::kGrey;
  int width = 0;
  int height = 0;
  std::size_t stride = 0;  // bytes from row to row; 0 with kMjpg
  std::span<const std::byte> bytes;
  // Of a source that decodes colour anyhow: the picture that the bytes are the grey of. Without pixels else, or where
  // the bytes themselves have the colour.
  ColourImage colour;
};

// Whether the bytes hold the picture that the frame announces; what a JPEG holds its decoder says.
[[nodiscard]] Expected<void> check_bytes(const CameraFrame& frame);

// Takes what a camera's thread has got; the frame ends with the call.
using CameraSink = std::function<void(const CameraFrame&)>;

}  // namespace perimap

#include "drivers/image/grey_converter.hpp"

#include <utility>

namespace perimap {
namespace {

// Every second byte of each row.
void take_every_second(const CameraFrame& frame, std::size_t first, std::uint8_t* out) noexcept {
  const auto width = static_cast<std::size_t>(frame.width);
  const auto* row = reinterpret_cast<const std::uint8_t*>(frame.bytes.data()) + first;
  for (int y = 0; y < frame.height; ++y, row += frame.stride, out += width) {
    for (std::size_t x = 0; x < width; ++x) out[x] = row[2 * x];
  }
}

}  // namespace

void GreyConverter::reserve(int width, int height) {
  grey_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
}

Expected<GreyImage> GreyConverter::convert(const CameraFrame& frame) {
  if (auto whole = check_bytes(frame); !whole) return tl::unexpected(std::move(whole.error()));
  const std::size_t pixels = static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  if (frame.format == PixelFormat::kGrey || frame.format == PixelFormat::kNv12) {
    return GreyImage{reinterpret_cast<const std::uint8_t*>(frame.bytes.data()), frame.width, frame.height,
                     static_cast<std::ptrdiff_t>(frame.stride)};
  }
  if (grey_.size() < pixels) grey_.resize(pixels);
  if (frame.format == PixelFormat::kMjpg) {
    if (auto decoded = jpeg_.decode(frame.bytes, frame.width, frame.height, grey_); !decoded) {
      return tl::unexpected(std::move(decoded.error()));
    }
  } else {
    take_every_second(frame, frame.format == PixelFormat::kUyvy ? 1 : 0, grey_.data());
  }
  return GreyImage{grey_.data(), frame.width, frame.height, frame.width};
}

}  // namespace perimap

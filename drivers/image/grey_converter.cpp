#include "drivers/image/grey_converter.hpp"

#include <fmt/format.h>

namespace perimap {
namespace {

constexpr int kLargestSide = 16384;

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
  if (frame.width <= 0 || frame.height <= 0 || frame.width > kLargestSide || frame.height > kLargestSide) {
    return fail(fmt::format("a frame of {} x {} pixels", frame.width, frame.height));
  }
  const std::size_t pixels = static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  if (frame.format != PixelFormat::kMjpg &&
      (frame.stride < row_bytes(frame.format, frame.width) ||
       frame.stride > (std::size_t{1} << 32U) ||  // so that the next product holds
       frame.bytes.size() < picture_bytes(frame.format, frame.height, frame.stride))) {
    return fail(fmt::format("{} x {} pixels of {} with {} bytes a row do not fit {} bytes", frame.width, frame.height,
                            pixel_format_name(frame.format), frame.stride, frame.bytes.size()));
  }
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

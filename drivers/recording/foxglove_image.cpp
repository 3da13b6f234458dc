#include "drivers/recording/foxglove_image.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <string_view>

#include "drivers/image/jpeg_decoder.hpp"

namespace perimap {
namespace {

constexpr char kMono8[] = "mono8";

// The generated types hold non-const pointers; a borrowed message is only ever read.
char* borrowed(const char* text) { return const_cast<char*>(text); }

template <class Sequence>
void lend(std::span<const std::byte> bytes, Sequence& data) {
  data._buffer = const_cast<std::uint8_t*>(reinterpret_cast<const std::uint8_t*>(bytes.data()));
  data._length = data._maximum = static_cast<std::uint32_t>(bytes.size());
  data._release = false;
}

}  // namespace

foxglove_Time to_foxglove_time(Instant time) noexcept {
  const auto ns = static_cast<std::uint64_t>(to_ns(time));
  return {static_cast<std::uint32_t>(ns / 1'000'000'000U), static_cast<std::uint32_t>(ns % 1'000'000'000U)};
}

foxglove_RawImage borrow_raw_image(const GreyImage& image, Instant time, const std::string& frame_id,
                                   std::vector<std::uint8_t>& packed) {
  const auto width = static_cast<std::uint32_t>(image.width);
  const auto height = static_cast<std::uint32_t>(image.height);
  const std::uint8_t* pixels = image.data;
  if (image.stride != image.width) {
    packed.resize(std::size_t{width} * height);
    for (int y = 0; y < image.height; ++y) {
      std::copy_n(image.row(y), width, packed.data() + static_cast<std::size_t>(y) * width);
    }
    pixels = packed.data();
  }
  foxglove_RawImage message{};
  message.timestamp = to_foxglove_time(time);
  message.frame_id = borrowed(frame_id.c_str());
  message.width = width;
  message.height = height;
  message.encoding = borrowed(kMono8);
  message.step = width;
  lend(std::as_bytes(std::span(pixels, std::size_t{width} * height)), message.data);
  return message;
}

foxglove_RawImage borrow_raw_image(const CameraFrame& frame, const std::string& frame_id) {
  const auto bytes = frame.bytes.first(picture_bytes(frame.format, frame.height, frame.stride));
  foxglove_RawImage message{};
  message.timestamp = to_foxglove_time(frame.stamp.capture);
  message.frame_id = borrowed(frame_id.c_str());
  message.width = static_cast<std::uint32_t>(frame.width);
  message.height = static_cast<std::uint32_t>(frame.height);
  message.encoding = borrowed(pixel_format_name(frame.format).data());
  message.step = static_cast<std::uint32_t>(frame.stride);
  lend(bytes, message.data);
  return message;
}

foxglove_CompressedImage borrow_compressed_image(const CameraFrame& frame, const std::string& frame_id) {
  foxglove_CompressedImage message{};
  message.timestamp = to_foxglove_time(frame.stamp.capture);
  message.frame_id = borrowed(frame_id.c_str());
  lend(frame.bytes, message.data);
  message.format = borrowed(pixel_format_name(PixelFormat::kMjpg).data());
  return message;
}

Expected<CameraFrame> borrow_camera_frame(const foxglove_RawImage& message) {
  const std::string_view encoding = message.encoding == nullptr ? "" : message.encoding;
  const auto format = pixel_format_of_name(encoding);
  if (!format || *format == PixelFormat::kMjpg) {
    return fail(fmt::format(R"(image encoding "{}", expected "mono8", "yuyv", "uyvy" or "nv12")", encoding));
  }
  constexpr std::uint32_t kMaxSide = 1U << 24U;  // so that no product of sizes overflows
  if (message.width == 0 || message.height == 0 || message.width > kMaxSide || message.height > kMaxSide ||
      message.step < row_bytes(*format, static_cast<int>(message.width)) ||
      picture_bytes(*format, static_cast<int>(message.height), message.step) > message.data._length) {
    return fail(fmt::format("image of {} x {} pixels with {} bytes a row does not fit its {} bytes", message.width,
                            message.height, message.step, message.data._length));
  }
  CameraFrame frame;
  frame.format = *format;
  frame.width = static_cast<int>(message.width);
  frame.height = static_cast<int>(message.height);
  frame.stride = message.step;
  frame.bytes = std::as_bytes(std::span(message.data._buffer, message.data._length));
  return frame;
}

Expected<CameraFrame> borrow_camera_frame(const foxglove_CompressedImage& message) {
  const std::string_view format = message.format == nullptr ? "" : message.format;
  if (format != pixel_format_name(PixelFormat::kMjpg)) {
    return fail(fmt::format(R"(image format "{}", expected "jpeg")", format));
  }
  CameraFrame frame;
  frame.format = PixelFormat::kMjpg;
  frame.bytes = std::as_bytes(std::span(message.data._buffer, message.data._length));
  if (const auto size = read_jpeg_size(frame.bytes)) {
    frame.width = size->width;
    frame.height = size->height;
  }
  return frame;
}

}  // namespace perimap

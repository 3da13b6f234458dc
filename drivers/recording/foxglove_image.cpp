#include "drivers/recording/foxglove_image.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string_view>

namespace perimap {
namespace {

constexpr char kMono8[] = "mono8";

// The generated types hold non-const pointers; a borrowed message is only ever read.
char* borrowed(const char* text) { return const_cast<char*>(text); }

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
  message.data._buffer = const_cast<std::uint8_t*>(pixels);
  message.data._length = message.data._maximum = width * height;
  message.data._release = false;
  return message;
}

Expected<GreyImage> borrow_grey_image(const foxglove_RawImage& message) {
  if (message.encoding == nullptr || std::string_view(message.encoding) != kMono8) {
    return fail(fmt::format(R"(image encoding "{}", expected "{}")",
                            message.encoding == nullptr ? "" : message.encoding, kMono8));
  }
  constexpr std::uint32_t kMaxSide = std::numeric_limits<std::int32_t>::max();
  if (message.width == 0 || message.height == 0 || message.width > kMaxSide || message.height > kMaxSide ||
      message.step < message.width || std::uint64_t{message.step} * message.height > message.data._length) {
    return fail(fmt::format("image of {} x {} pixels with {} bytes a row does not fit its {} bytes", message.width,
                            message.height, message.step, message.data._length));
  }
  return GreyImage{message.data._buffer, static_cast<int>(message.width), static_cast<int>(message.height),
                   static_cast<std::ptrdiff_t>(message.step)};
}

}  // namespace perimap

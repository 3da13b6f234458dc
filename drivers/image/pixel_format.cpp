#include "drivers/image/pixel_format.hpp"

#include <array>
#include <utility>

namespace perimap {
namespace {

constexpr std::array<std::pair<PixelFormat, std::string_view>, 5> kNames{{{PixelFormat::kGrey, "mono8"},
                                                                          {PixelFormat::kYuyv, "yuyv"},
                                                                          {PixelFormat::kUyvy, "uyvy"},
                                                                          {PixelFormat::kNv12, "nv12"},
                                                                          {PixelFormat::kMjpg, "jpeg"}}};

}  // namespace

std::string_view pixel_format_name(PixelFormat format) noexcept {
  for (const auto& [named, name] : kNames) {
    if (named == format) return name;
  }
  return "";
}

std::optional<PixelFormat> pixel_format_of_name(std::string_view name) noexcept {
  for (const auto& [format, known] : kNames) {
    if (known == name) return format;
  }
  return std::nullopt;
}

std::size_t row_bytes(PixelFormat format, int width) noexcept {
  const auto pixels = static_cast<std::size_t>(width);
  switch (format) {
    case PixelFormat::kYuyv:
    case PixelFormat::kUyvy:
      return 4 * ((pixels + 1) / 2);
    case PixelFormat::kNv12:
      return 2 * ((pixels + 1) / 2);
    case PixelFormat::kGrey:
      return pixels;
    case PixelFormat::kMjpg:
      break;
  }
  return 0;
}

std::size_t picture_bytes(PixelFormat format, int height, std::size_t stride) noexcept {
  if (format == PixelFormat::kMjpg) return 0;
  const auto rows = static_cast<std::size_t>(height);
  return stride * (format == PixelFormat::kNv12 ? rows + (rows + 1) / 2 : rows);
}

}  // namespace perimap

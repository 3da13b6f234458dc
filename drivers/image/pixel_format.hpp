// How a camera's bytes hold its picture.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace perimap {

// 8 bits a sample. Those with colour hold luma Y and chroma U, V (ITU-R BT.601), subsampled.
enum class PixelFormat : std::uint8_t {
  kGrey,  // Y
  kYuyv,  // Y U Y V for every two pixels of a row
  kUyvy,  // U Y V Y, likewise
  kNv12,  // all rows of Y, then half as many of U V, for every two by two pixels
  kMjpg,  // a JPEG a frame; its Huffman tables may be left out, which then are those of ITU-T T.81 annex K.3
};

// "mono8", "yuyv", "uyvy", "nv12" (the names of viewers for raw images), "jpeg".
[[nodiscard]] std::string_view pixel_format_name(PixelFormat format) noexcept;
[[nodiscard]] std::optional<PixelFormat> pixel_format_of_name(std::string_view name) noexcept;

// Bytes that a row of this many pixels takes at least, in the first plane; 0 with kMjpg, which has no rows.
[[nodiscard]] std::size_t row_bytes(PixelFormat format, int width) noexcept;
// Bytes that a picture takes at least, with rows `stride` bytes apart; 0 with kMjpg.
[[nodiscard]] std::size_t picture_bytes(PixelFormat format, int height, std::size_t stride) noexcept;

}  // namespace perimap

// A borrowed 8-bit colour image.
#pragma once

#include <cstddef>
#include <cstdint>

namespace perimap {

// Blue, green, red; 3 bytes a pixel. Row y starts at bgr + y * stride.
struct ColourImage {
  const std::uint8_t* bgr = nullptr;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;  // bytes from row to row, >= 3 * width

  [[nodiscard]] const std::uint8_t* row(int y) const noexcept { return bgr + y * stride; }
};

// What goes with a grey frame of a colour camera: one pixel for so many by so many. Video's colour is coarse anyhow,
// and what is told by it, instruments, is large.
inline constexpr int kColourReduction = 4;
[[nodiscard]] constexpr int reduced_side(int side) noexcept { return (side + kColourReduction - 1) / kColourReduction; }
// Of a view of this width, reduced, without gaps between rows.
[[nodiscard]] constexpr std::size_t reduced_row_bytes(int width) noexcept {
  return std::size_t{3} * static_cast<std::size_t>(reduced_side(width));
}

}  // namespace perimap

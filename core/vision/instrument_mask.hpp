// Where a colour image shows something grey: steel and plastic, not tissue.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/grey_image.hpp"

namespace perimap {

// An image of 8-bit pixels, blue, green, red; rows `stride` bytes apart. Borrowed.
struct ColourImage {
  const std::uint8_t* bgr = nullptr;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;
};

// 255 where the surroundings of a pixel have too little colour for tissue, with a margin about them; all 0 when most of
// the lit image is grey, because then colour tells nothing. width x height, without gaps between rows. Allocates.
// An error for an image that cannot be read.
[[nodiscard]] Expected<std::vector<std::uint8_t>> find_instruments(const ColourImage& image);

}  // namespace perimap

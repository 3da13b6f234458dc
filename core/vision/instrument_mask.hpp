// Where a colour image shows something grey: steel and plastic, not tissue.
#pragma once

#include <cstdint>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/colour_image.hpp"

namespace perimap {

// Of a view of width x height pixels, 255 where the surroundings of a pixel have too little colour for tissue, with a
// margin of an 80th of the picture's width about them, least_margin_px at least: no template reaches onto them then;
// all 0 when most of the lit image is grey, because then colour tells nothing. Without gaps between rows. The colour
// image shows the whole view, reduced or not. Allocates. An error for an image that cannot be read.
[[nodiscard]] Expected<std::vector<std::uint8_t>> find_instruments(const ColourImage& image, int width, int height,
                                                                   double least_margin_px = 16);

}  // namespace perimap

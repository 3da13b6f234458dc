// How bright a picture is, whatever camera took it.
#pragma once

#include "core/sensors/grey_image.hpp"

namespace perimap {

struct PictureLight {
  static constexpr double kUsual_grey = 90;

  double lit_grey = kUsual_grey;  // the median of what is lit; 0 when nothing is
  bool has_surround = false;  // an even frame about a view that does not fill the picture, as a field stop leaves it
  double surround_grey = 0;   // of that; 0 without one
  int white_grey = 255;       // what is clipped; 235 in video of limited range (ITU-R BT.601)
};

// The surround is told by corners of the picture that are flat, of one grey, and far darker than what is lit.
[[nodiscard]] PictureLight estimate_light(const GreyImage& image);

}  // namespace perimap

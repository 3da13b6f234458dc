// How noisy the pixels of an image are.
#pragma once

#include "core/sensors/grey_image.hpp"

namespace perimap {

// Standard deviation of the noise of single pixels, grey levels, from how far a pixel lies off the bilinear surface
// through its neighbours (Immerkaer, "Fast Noise Variance Estimation", CVIU 64(2), 1996; here by the median, because
// texture has long tails). Only what is neither dark nor clipped counts; 0 when nothing does.
inline constexpr int kDark_grey = 25;
[[nodiscard]] double estimate_noise(const GreyImage& image, int dark_grey = kDark_grey);

}  // namespace perimap

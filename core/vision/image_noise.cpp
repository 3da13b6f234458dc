#include "core/vision/image_noise.hpp"

#include <array>
#include <cstdint>
#include <cstdlib>

#include "core/vision/grey_histogram.hpp"

namespace perimap {

double estimate_noise(const GreyImage& image, int dark_grey) {
  constexpr int kClipped = 245;
  const int step = sampling_step(image);
  // The sum below is an integer of at most 8 * 255.
  std::array<int, 8 * 255 + 1> counts{};
  long total = 0;
  for (int y = 1; y + 1 < image.height; y += step) {
    const std::uint8_t* const above = image.row(y - 1);
    const std::uint8_t* const here = image.row(y);
    const std::uint8_t* const below = image.row(y + 1);
    for (int x = 1; x + 1 < image.width; x += step) {
      if (here[x] < dark_grey || here[x] > kClipped) continue;
      const int off = above[x - 1] - 2 * above[x] + above[x + 1] - 2 * here[x - 1] + 4 * here[x] - 2 * here[x + 1] +
                      below[x - 1] - 2 * below[x] + below[x + 1];
      ++counts[static_cast<std::size_t>(std::abs(off))];
      ++total;
    }
  }
  if (total == 0) return 0;
  long below_it = 0;
  std::size_t median = 0;
  while (below_it + counts[median] < total / 2) below_it += counts[median++];
  // Within the median's own bin, evenly.
  const double within =
      counts[median] > 0 ? (0.5 * static_cast<double>(total) - static_cast<double>(below_it)) / counts[median] : 0.5;
  constexpr double kMedianOfNormal = 0.6745, kGain = 6;  // of the sum: the root of its squared weights
  return (static_cast<double>(median) - 0.5 + within) / (kMedianOfNormal * kGain);
}

}  // namespace perimap

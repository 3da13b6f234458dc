#include "core/vision/picture_light.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/vision/grey_histogram.hpp"

namespace perimap {
namespace {

// The mean of a corner of the picture, when it is flat but for noise.
std::optional<double> flat_corner(const GreyImage& image, bool right, bool bottom) {
  constexpr double kFlat_grey = 3;
  const int side = std::max(1, std::min(image.width, image.height) / 20);
  double sum = 0, squares = 0;
  for (int y = 0; y < side; ++y) {
    const std::uint8_t* const row = image.row(bottom ? image.height - 1 - y : y) + (right ? image.width - side : 0);
    for (int x = 0; x < side; ++x) {
      sum += row[x];
      squares += row[x] * row[x];
    }
  }
  const double count = static_cast<double>(side) * side, mean = sum / count;
  if (squares / count - mean * mean > kFlat_grey * kFlat_grey) return std::nullopt;
  return mean;
}

// What at least two flat corners agree upon.
std::optional<double> surround_of(const GreyImage& image) {
  constexpr double kAlike_grey = 5;
  std::vector<double> corners;
  for (const bool right : {false, true}) {
    for (const bool bottom : {false, true}) {
      if (const auto corner = flat_corner(image, right, bottom)) corners.push_back(*corner);
    }
  }
  std::sort(corners.begin(), corners.end());
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    if (corners[i + 1] - corners[i] <= kAlike_grey) return corners[i + 1];
  }
  return std::nullopt;
}

}  // namespace

PictureLight estimate_light(const GreyImage& image) {
  constexpr double kBrightShare = 0.95, kLitOfBright = 0.25, kSurroundOfLit = 0.5;
  const GreyHistogram counts(image, sampling_step(image));
  const auto lit_above = [&](double surround) {
    constexpr double kMargin_grey = 6;
    const double bright = counts.quantile(kBrightShare);
    const int least = static_cast<int>(std::max({1.0, surround + kMargin_grey, kLitOfBright * bright}));
    return static_cast<double>(counts.quantile(0.5, least));
  };
  PictureLight light;
  if (image.width < 1 || image.height < 1) return light;
  // Beyond a limited range's white there is no more than the overshoots of sharpened edges. Where that is so of a full
  // range, nothing is clipped, and what is nearly white is no place for a feature either.
  constexpr int kBeyondLimited_grey = 241, kLimitedWhite_grey = 235;
  constexpr double kNextToNothing = 1e-3;
  if (counts.share_from(kBeyondLimited_grey) < kNextToNothing) light.white_grey = kLimitedWhite_grey;
  const auto surround = surround_of(image);
  light.has_surround = surround.has_value();
  light.surround_grey = surround.value_or(0);
  light.lit_grey = lit_above(light.surround_grey);
  if (light.surround_grey > kSurroundOfLit * light.lit_grey) {
    light.has_surround = false;
    light.surround_grey = 0;
    light.lit_grey = lit_above(0);
  }
  return light;
}

}  // namespace perimap

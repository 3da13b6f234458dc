#include "core/following/picture_validity.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/vision/grey_histogram.hpp"

namespace perimap {
namespace {

RegionFault fault_of(double usual_mean, double usual_contrast, double mean, double contrast) noexcept {
  constexpr double kDark_grey = 12, kLit_grey = 25, kGlare_grey = 235, kOther_grey = 12, kLeastOfContrast = 0.45;
  if (mean < kDark_grey && usual_mean > kLit_grey) return RegionFault::kDark;
  if (mean > kGlare_grey) return RegionFault::kGlare;
  if (contrast > kLeastOfContrast * usual_contrast) return RegionFault::kNone;
  if (mean > usual_mean + kOther_grey) return RegionFault::kVeiled;
  return mean < usual_mean - kOther_grey ? RegionFault::kStained : RegionFault::kBlurred;
}

}  // namespace

void PictureValidity::judge(Region& region, double mean, double contrast) const noexcept {
  constexpr double kSeen_s = 2, kNotSeen_s = 60;
  region.fault = fault_of(region.mean, region.contrast, mean, contrast);
  const double lately_s = region.fault == RegionFault::kNone ? kSeen_s : kNotSeen_s;
  const double share = std::min(1.0, 1 / (lately_s * frames_per_s_));
  region.mean += share * (mean - region.mean);
  region.contrast += share * (contrast - region.contrast);
}

void PictureValidity::look_at(const GreyImage& image) noexcept {
  const bool is_first = image.width != width_ || image.height != height_;
  width_ = image.width;
  height_ = image.height;
  const int step = sampling_step(image);
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const int left = column * width_ / kColumns, right = std::min((column + 1) * width_ / kColumns, width_ - step);
      const int top = row * height_ / kRows, bottom = std::min((row + 1) * height_ / kRows, height_ - step);
      double sum = 0, differences = 0;
      int count = 0;
      for (int y = top; y < bottom; y += step) {
        const std::uint8_t* const here = image.row(y);
        const std::uint8_t* const below = image.row(y + step);
        for (int x = left; x < right; x += step, ++count) {
          sum += here[x];
          differences += std::abs(here[x + step] - here[x]) + std::abs(below[x] - here[x]);
        }
      }
      if (count == 0) continue;
      Region& region = regions_[static_cast<std::size_t>(row * kColumns + column)];
      if (is_first) region = {sum / count, differences / count, RegionFault::kNone};
      judge(region, sum / count, differences / count);
    }
  }
}

RegionFault PictureValidity::at(const Vector2d& px) const noexcept {
  if (width_ < 1 || height_ < 1 || !px.allFinite()) return RegionFault::kNone;
  const int column = static_cast<int>(std::clamp(px.x() * kColumns / width_, 0.0, kColumns - 1.0));
  const int row = static_cast<int>(std::clamp(px.y() * kRows / height_, 0.0, kRows - 1.0));
  return regions_[static_cast<std::size_t>(row * kColumns + column)].fault;
}

double PictureValidity::share_of(RegionFault fault) const noexcept {
  const auto count =
      std::count_if(regions_.begin(), regions_.end(), [fault](const Region& region) { return region.fault == fault; });
  return static_cast<double>(count) / static_cast<double>(regions_.size());
}

}  // namespace perimap

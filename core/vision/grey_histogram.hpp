// How often each grey level occurs in an image.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>

#include "core/sensors/grey_image.hpp"

namespace perimap {

// As many pixels of large images as of small ones are enough to tell what they are like.
[[nodiscard]] inline int sampling_step(const GreyImage& image) noexcept { return std::max(2, image.width / 320); }

class GreyHistogram {
 public:
  // Of every step-th pixel of every step-th row, from the middle of the first step on.
  GreyHistogram(const GreyImage& image, int step) noexcept {
    for (int y = step / 2; y < image.height; y += step) {
      for (int x = step / 2; x < image.width; x += step) ++counts_[image.row(y)[x]];
    }
  }

  // The lowest grey level, of `least` and above, that this share of what is counted there does not exceed; 0 when
  // nothing is counted there.
  [[nodiscard]] int quantile(double share, int least = 0) const noexcept {
    if (least > kLargest) return 0;
    const auto begin = counts_.begin() + least;
    const double wanted = share * std::accumulate(begin, counts_.end(), 0.0);
    double below = 0;
    for (auto count = begin; count != counts_.end(); ++count) {
      below += *count;
      if (*count > 0 && below >= wanted) return static_cast<int>(count - counts_.begin());
    }
    return 0;
  }

  // Of all that is counted; 0 when nothing is.
  [[nodiscard]] double share_from(int grey) const noexcept {
    const double all = std::accumulate(counts_.begin(), counts_.end(), 0.0);
    return all > 0 ? std::accumulate(counts_.begin() + grey, counts_.end(), 0.0) / all : 0;
  }

 private:
  static constexpr int kLargest = 255;

  std::array<int, kLargest + 1> counts_{};
};

}  // namespace perimap

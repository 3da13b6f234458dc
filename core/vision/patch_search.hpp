// Exhaustive search for a template level over whole pixels of an image level, by normalised cross-correlation.
#pragma once

#include <array>

#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/vision/patch_kernels.hpp"
#include "core/vision/patch_template.hpp"

namespace perimap {

struct SearchPeak {
  Vector2d centre;         // where the feature would be, level pixels
  double correlation = 0;  // zero-mean normalised, [-1, 1]
};

struct SearchResult {
  static constexpr int kMaxPeaks = 3;
  std::array<SearchPeak, kMaxPeaks> peaks;  // best first
  int count = 0;
  bool any_in_view = false;  // the window lay inside the image for at least one position
};

inline constexpr int kMaxSearchRadius = 10;  // level pixels

// Looks at every whole-pixel shift of the warped template within the ellipse e' information e <= gate about
// predicted and within kMaxSearchRadius of it. Peaks are local maxima above min_correlation, ordered by correlation
// less a small price for their distance from the prediction. information: inverse covariance of predicted,
// 1/level px^2, positive definite. level must be usable, A invertible, everything finite.
[[nodiscard]] SearchResult search_peaks(const GreyImage& image, const PatchTemplate::Level& level, const Matrix2d& A,
                                        const Vector2d& predicted, const Matrix2d& information, double gate,
                                        double min_correlation, const PatchKernels& kernels) noexcept;

}  // namespace perimap

#include "core/vision/patch_search.hpp"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

constexpr int kWidth = 2 * kMaxSearchRadius + 1;                             // positions across
constexpr int kRegionSide = SearchPattern::kMaxSide + 2 * kMaxSearchRadius;  // pixels the windows of all cover
constexpr int kRegionStride = 2 * kMaxSearchRadius + SearchPattern::kStride + 4;

// The template, smoothed as templates are, as it would look in the image, on whole image pixels about the feature's
// nearest one, PatchTemplate::kGreyScale (T - mean over the weighted pixels), rounded. Where the warp reaches outside
// the template the weight is 0, and so is the value.
struct WarpedTemplate {
  double sum_squares = 0;  // of the values
  double value_sum = 0;    // 0 but for rounding
  double weight_sum = 0;
  SearchPattern pattern;
};

WarpedTemplate warp_template(const PatchTemplate::Level& level, const Matrix2d& A) noexcept {
  WarpedTemplate warped;
  SearchPattern& pattern = warped.pattern;
  pattern.side = level.side;
  const Matrix2d back = A.inverse();
  const int half = level.half();
  std::array<double, PatchTemplate::kMaxSamples> grey{};
  double sum = 0;
  for (int y = 0; y < level.side; ++y) {
    for (int x = 0; x < level.side; ++x) {
      // The window's pixel as an offset from the feature, taken back into the template's own pixels.
      const Vector2d d = back * Vector2d(x - half, y - half);
      const double u = d.x() + level.offset_x + half, v = d.y() + level.offset_y + half;
      const double last = level.side - 1;
      // Half a pixel outside still shows the border pixel.
      if (!(u > -0.5 && v > -0.5 && u < last + 0.5 && v < last + 0.5)) continue;
      const double uc = std::clamp(u, 0.0, last), vc = std::clamp(v, 0.0, last);
      const int u0 = std::min(static_cast<int>(uc), level.side - 2),
                v0 = std::min(static_cast<int>(vc), level.side - 2);
      const double fu = uc - u0, fv = vc - v0;
      const std::int16_t* const p = level.value.data() + v0 * level.side + u0;
      const std::int16_t* const q = p + level.side;
      const double g = (1 - fv) * ((1 - fu) * p[0] + fu * p[1]) + fv * ((1 - fu) * q[0] + fu * q[1]);
      grey[static_cast<std::size_t>(y * level.side + x)] = g;
      pattern.mask[static_cast<std::size_t>(y * SearchPattern::kStride + x)] = -1;
      warped.weight_sum += 1;
      sum += g;
    }
  }
  if (warped.weight_sum == 0) return warped;
  const double mean = sum / warped.weight_sum;
  for (int y = 0; y < level.side; ++y) {
    for (int x = 0; x < level.side; ++x) {
      const auto i = static_cast<std::size_t>(y * SearchPattern::kStride + x);
      if (pattern.mask[i] == 0) continue;
      const double centred = grey[static_cast<std::size_t>(y * level.side + x)] - mean;
      pattern.value[i] = static_cast<std::int16_t>(std::lround(centred));
      warped.value_sum += pattern.value[i];
      warped.sum_squares += static_cast<double>(pattern.value[i]) * pattern.value[i];
    }
  }
  return warped;
}

// Of the warped template with a window of the image. The sums fit 32 bits: 441 pixels of at most 255 * 16 * 255.
double correlation_of(const WarpedTemplate& warped, const SearchSums& sums) noexcept {
  const double mean = sums.grey / warped.weight_sum;
  const double variance_sum = sums.grey_squared - sums.grey * mean;
  const double covariance_sum = sums.with_value - mean * warped.value_sum;
  constexpr double kFlat = 0.5;  // grey levels^2 in all: a single pixel that differs by one gives more
  if (!(variance_sum > kFlat) || !(warped.sum_squares > 0)) return 0;
  return covariance_sum / std::sqrt(variance_sum * warped.sum_squares);
}

void insert_peak(const SearchPeak& peak, double score, std::array<double, SearchResult::kMaxPeaks>& scores,
                 SearchResult& result) noexcept {
  int place = result.count;
  while (place > 0 && scores[static_cast<std::size_t>(place - 1)] < score) --place;
  if (place >= SearchResult::kMaxPeaks) return;
  result.count = std::min(result.count + 1, SearchResult::kMaxPeaks);
  for (int i = result.count - 1; i > place; --i) {
    result.peaks[static_cast<std::size_t>(i)] = result.peaks[static_cast<std::size_t>(i - 1)];
    scores[static_cast<std::size_t>(i)] = scores[static_cast<std::size_t>(i - 1)];
  }
  result.peaks[static_cast<std::size_t>(place)] = peak;
  scores[static_cast<std::size_t>(place)] = score;
}

}  // namespace

SearchResult search_peaks(const GreyImage& image, const PatchTemplate::Level& level, const Matrix2d& A,
                          const Vector2d& predicted, const Matrix2d& information, double gate, double min_correlation,
                          const PatchKernels& kernels) noexcept {
  SearchResult result;
  if (!(predicted.x() > -kMaxSearchRadius && predicted.y() > -kMaxSearchRadius &&
        predicted.x() < image.width + kMaxSearchRadius && predicted.y() < image.height + kMaxSearchRadius)) {
    return result;
  }
  const WarpedTemplate warped = warp_template(level, A);
  if (2 * warped.weight_sum < level.side * level.side) return result;  // the warp shows too little of the template

  const int centre_u = static_cast<int>(std::lround(predicted.x()));
  const int centre_v = static_cast<int>(std::lround(predicted.y()));
  // Of the ellipse e' I e <= gate the extent along each axis is sqrt(gate C_ii), C = I^-1.
  const Matrix2d covariance = information.inverse();
  const auto extent = [gate](double variance) {
    return static_cast<int>(std::min<double>(std::ceil(std::sqrt(gate * variance)), kMaxSearchRadius));
  };
  const int radius_u = extent(covariance(0, 0)), radius_v = extent(covariance(1, 1));

  // The pixels that all windows cover, widened once. Beyond the image they are never used: see in_image below.
  alignas(64) std::array<std::int16_t, (kRegionSide + 1) * kRegionStride> region{};
  const int half = level.half();
  const int left = centre_u - radius_u - half, top = centre_v - radius_v - half;
  for (int y = 0; y < level.side + 2 * radius_v; ++y) {
    if (top + y < 0 || top + y >= image.height) continue;
    const int first = std::max(0, -left), last = std::min(level.side + 2 * radius_u, image.width - left);
    const std::uint8_t* const row = image.row(top + y);
    for (int x = first; x < last; ++x) {
      region[static_cast<std::size_t>(y * kRegionStride + x)] = row[left + x];
    }
  }

  constexpr double kNotLooked = -2;
  std::array<double, kWidth * kWidth> correlation{};
  std::array<double, kWidth * kWidth> price{};
  correlation.fill(kNotLooked);
  const auto index = [](int du, int dv) {
    return static_cast<std::size_t>((dv + kMaxSearchRadius) * kWidth + du + kMaxSearchRadius);
  };
  for (int dv = -radius_v; dv <= radius_v; ++dv) {
    for (int du = -radius_u; du <= radius_u; ++du) {
      const int u = centre_u + du, v = centre_v + dv;
      const bool in_image = u >= half && v >= half && u + half < image.width && v + half < image.height;
      if (!in_image) continue;
      result.any_in_view = true;
      const Vector2d e = Vector2d(u, v) - predicted;
      const double distance_squared = e.dot(information * e);
      const bool nearest = du == 0 && dv == 0;
      if (!(distance_squared <= gate) && !nearest) continue;
      const std::int16_t* const first = region.data() + (dv + radius_v) * kRegionStride + du + radius_u;
      SearchSums sums;
      kernels.correlate(warped.pattern, first, kRegionStride, sums);
      correlation[index(du, dv)] = correlation_of(warped, sums);
      price[index(du, dv)] = distance_squared;
    }
  }

  constexpr double kPriceOfDistance = 0.01;  // in correlation, for one unit of squared Mahalanobis distance
  std::array<double, SearchResult::kMaxPeaks> scores{};
  for (int dv = -radius_v; dv <= radius_v; ++dv) {
    for (int du = -radius_u; du <= radius_u; ++du) {
      const double here = correlation[index(du, dv)];
      if (!(here > min_correlation)) continue;
      bool is_peak = true;
      for (int ny = std::max(dv - 1, -kMaxSearchRadius); ny <= std::min(dv + 1, kMaxSearchRadius); ++ny) {
        for (int nx = std::max(du - 1, -kMaxSearchRadius); nx <= std::min(du + 1, kMaxSearchRadius); ++nx) {
          is_peak = is_peak && correlation[index(nx, ny)] <= here;
        }
      }
      if (!is_peak) continue;
      insert_peak({Vector2d(centre_u + du, centre_v + dv), here}, here - kPriceOfDistance * price[index(du, dv)],
                  scores, result);
    }
  }
  return result;
}

}  // namespace perimap

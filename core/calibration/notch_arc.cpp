#include "core/calibration/notch_arc.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>

#include "core/angle/angle.hpp"
#include "core/calibration/edge_on_ray.hpp"

namespace perimap {
namespace {

constexpr double kStep_rad = 0.2 * kDegree;
constexpr double kNotchHalf_rad = 0.10;  // wider than half a notch, as read_field_stop() has it
constexpr double kArcHalf_rad = 0.20;
constexpr int kNotchHalf = static_cast<int>(kNotchHalf_rad / kStep_rad);
constexpr int kHalf = static_cast<int>((kArcHalf_rad + kNotchHalf_rad) / kStep_rad);
constexpr int kPlaces = 2 * kHalf + 1;

// How far inside the circle the edge lies, along the arc; not a number where it is not seen.
using Depths = std::array<double, kPlaces>;

Depths depths_of(const GreyImage& picture, const FieldStopReading& stop, double near_rad) noexcept {
  constexpr double kOutside_px = 5.0;
  const double inner_px = stop.radius_px - std::max(1.6 * stop.notch_depth_px, 8.0);
  Depths depths{};
  for (int i = 0; i < kPlaces; ++i) {
    const double angle = near_rad + (i - kHalf) * kStep_rad;
    const auto r = edge_on_ray(picture, stop.edge_level, stop.centre_px, angle, stop.radius_px + kOutside_px, inner_px);
    depths[static_cast<std::size_t>(i)] = r ? stop.radius_px - *r : std::nan("");
  }
  return depths;
}

struct Window {
  int middle = 0;
  double area = 0.0;  // of what is more than noise
  double deepest = 0.0;
};

Window largest_window(const Depths& depths, double noise_px) noexcept {
  Window best;
  for (int middle = kNotchHalf; middle < kPlaces - kNotchHalf; ++middle) {
    Window window{middle};
    for (int k = -kNotchHalf; k <= kNotchHalf; ++k) {
      const double depth = depths[static_cast<std::size_t>(middle + k)];
      if (!(depth > noise_px)) continue;
      window.area += depth;
      window.deepest = std::max(window.deepest, depth);
    }
    if (window.area > best.area) best = window;
  }
  return best;
}

// Most of the arc beside the notch is seen, lies on the circle, and nothing else reaches into the picture there.
bool lies_on_circle(const Depths& depths, const Window& notch, double noise_px) noexcept {
  int beside = 0, seen_on_circle = 0;
  double other_area = 0.0;
  for (int i = 0; i < kPlaces; ++i) {
    if (std::abs(i - notch.middle) <= kNotchHalf) continue;
    const double depth = depths[static_cast<std::size_t>(i)];
    ++beside;
    if (std::abs(depth) <= noise_px) ++seen_on_circle;
    if (depth > noise_px) other_area += depth;
  }
  return 3 * seen_on_circle >= 2 * beside && other_area <= 0.3 * notch.area;
}

}  // namespace

std::optional<TurnReading> read_notch_near(const GreyImage& picture, const FieldStopReading& stop,
                                           double near_rad) noexcept {
  const Depths depths = depths_of(picture, stop, near_rad);
  const double noise_px = std::max(1.5, 4.0 * stop.edge_deviation_px);
  const Window notch = largest_window(depths, noise_px);
  // Of another depth it is another thing.
  if (notch.deepest < 0.6 * stop.notch_depth_px || notch.deepest > 1.5 * stop.notch_depth_px) return std::nullopt;
  if (!lies_on_circle(depths, notch, noise_px)) return std::nullopt;
  // The middle of its area; its window moves with it.
  double offset = 0.0, area = 0.0, squares = 0.0;
  for (int round = 0; round < 6; ++round) {
    const int middle = notch.middle + static_cast<int>(std::lround(offset));
    if (middle < kNotchHalf || middle >= kPlaces - kNotchHalf) return std::nullopt;
    double moment = 0.0;
    area = squares = 0.0;
    for (int i = middle - kNotchHalf; i <= middle + kNotchHalf; ++i) {
      const double depth = depths[static_cast<std::size_t>(i)];
      if (std::isnan(depth)) continue;
      const double k = i - notch.middle;
      area += depth;
      moment += depth * k;
      squares += (k - offset) * (k - offset);
    }
    if (!(area > 0.0)) return std::nullopt;
    offset = std::clamp(moment / area, offset - 0.5 * kNotchHalf, offset + 0.5 * kNotchHalf);
  }
  const double by_edge = std::sqrt(stop.edge_density_px2_rad * kStep_rad * squares) / area;
  TurnReading reading;
  reading.rotation_rad = std::remainder(near_rad + (notch.middle - kHalf + offset) * kStep_rad, kTwoPi);
  reading.deviation_rad = std::hypot(by_edge, stop.centre_deviation_px / stop.radius_px);
  return reading;
}

}  // namespace perimap

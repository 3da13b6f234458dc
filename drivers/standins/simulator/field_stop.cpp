#include "drivers/standins/simulator/field_stop.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/standins/random/counter_noise.hpp"

namespace perimap {

double FieldStop::passed(const Vector2d& px) const noexcept {
  if (radius_px <= 0.0) return 1.0;
  const Vector2d d = px - centre_px;
  const Vector2d along(std::cos(notch_rad), std::sin(notch_rad));
  double inside = radius_px - d.norm();
  // The notch is a triangle that stands on the circle and points inwards.
  const double radial = d.dot(along);
  const double across = std::abs(d.x() * along.y() - d.y() * along.x());
  if (radial > 0.0 && notch_depth_px > 0.0) {
    const double tip = radius_px - notch_depth_px;
    const double half = 0.5 * notch_width_px;
    // Distance from the triangle's side, positive outside of it.
    const double slope = std::hypot(half, notch_depth_px);
    const double outside = (across * notch_depth_px - (radial - tip) * half) / slope;
    inside = std::min(inside, outside);
  }
  constexpr double kSoft_px = 1.5;
  return std::clamp(0.5 + inside / kSoft_px, 0.0, 1.0);
}

FieldStop drawn_field_stop(std::uint64_t setup_seed, int width_px, int height_px, const ScopeHeld& held) noexcept {
  constexpr std::uint64_t kFieldStop = 111;
  const CounterNoise noise(setup_seed, kFieldStop);
  const double height = height_px;
  FieldStop stop;
  stop.centre_px = Vector2d(0.5 * width_px + noise.uniform(0, -0.02, 0.02) * height,
                            0.5 * height + noise.uniform(1, -0.02, 0.02) * height);
  stop.radius_px = noise.uniform(2, 0.42, 0.46) * height * held.zoom;
  stop.notch_rad = held.notch_rad;
  stop.notch_depth_px = 0.07 * stop.radius_px;
  stop.notch_width_px = 0.10 * stop.radius_px;
  return stop;
}

}  // namespace perimap

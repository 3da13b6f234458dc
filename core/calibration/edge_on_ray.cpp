#include "core/calibration/edge_on_ray.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace perimap {
namespace {

double value_at(const GreyImage& picture, const Vector2d& px) noexcept {
  const double x = std::clamp(px.x(), 0.0, picture.width - 1.001);
  const double y = std::clamp(px.y(), 0.0, picture.height - 1.001);
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const double a = x - i, b = y - j;
  const std::uint8_t* row = picture.data + j * picture.stride + i;
  const std::uint8_t* next = row + picture.stride;
  return (1.0 - b) * ((1.0 - a) * row[0] + a * row[1]) + b * ((1.0 - a) * next[0] + a * next[1]);
}

bool inside(const GreyImage& picture, const Vector2d& px) noexcept {
  return px.x() >= 0.0 && px.y() >= 0.0 && px.x() <= picture.width - 1.0 && px.y() <= picture.height - 1.0;
}

}  // namespace

std::optional<double> edge_on_ray(const GreyImage& picture, double level, const Vector2d& centre_px, double angle_rad,
                                  double outer_px, double inner_px) noexcept {
  const Vector2d along(std::cos(angle_rad), std::sin(angle_rad));
  double outer = outer_px;
  while (outer > inner_px && !inside(picture, centre_px + outer * along)) outer -= 1.0;
  double before = value_at(picture, centre_px + outer * along);
  if (before > level) return std::nullopt;
  const int steps = static_cast<int>(outer - inner_px);
  for (int step = 1; step <= steps; ++step) {
    const double r = outer - step;
    const double here = value_at(picture, centre_px + r * along);
    // Noise alone does not last for two more pixels.
    if (here > level && value_at(picture, centre_px + (r - 1.5) * along) > level) {
      return r + (here - level) / std::max(1e-6, here - before);
    }
    before = here;
  }
  return std::nullopt;
}

}  // namespace perimap

#include "core/bank/pinhole_lens.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace perimap {
namespace {

// Extrema of 1 + 3 k1 u + 5 k2 u^2 + 7 k3 u^3 = d(r radial)/dr, u = r^2, where it is not positive.
double least_turn(const CameraModel& camera) noexcept {
  double least = std::numeric_limits<double>::infinity();
  const double g1 = 3.0 * camera.k1;
  const double g2 = 5.0 * camera.k2;
  const double g3 = 7.0 * camera.k3;
  const double discriminant = g2 * g2 - 3.0 * g1 * g3;
  if (!(discriminant >= 0.0)) return least;
  // The roots of g1 + 2 g2 u + 3 g3 u^2, in a form that also serves g3 = 0.
  const double q = -(g2 + std::copysign(std::sqrt(discriminant), g2));
  for (const double u : {g1 / q, q / (3.0 * g3)}) {
    if (u > 0.0 && 1.0 + u * (g1 + u * (g2 + u * g3)) <= 0.0) least = std::min(least, u);
  }
  return least;
}

}  // namespace

template <class Real>
PinholeLens<Real> pinhole_lens(const CameraModel& camera) noexcept {
  const auto real = [](double value) { return static_cast<Real>(value); };
  return {real(camera.fx), real(camera.fy), real(camera.cx), real(camera.cy), real(camera.k1),
          real(camera.k2), real(camera.p1), real(camera.p2), real(camera.k3), real(least_turn(camera))};
}

template PinholeLens<double> pinhole_lens(const CameraModel&) noexcept;
template PinholeLens<float> pinhole_lens(const CameraModel&) noexcept;

}  // namespace perimap

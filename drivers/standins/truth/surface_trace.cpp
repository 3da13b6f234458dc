#include "drivers/standins/truth/surface_trace.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace perimap {

Expected<void> check(const SurfaceTrace& trace) {
  constexpr std::size_t kFewest = 4;
  if (trace.empty()) return {};
  const std::size_t points = trace.places_W.size();
  if (points == 0 || trace.displacements_W.size() % points != 0) {
    return fail("motion trace: its displacements are not as many of each point");
  }
  if (trace.displacements_W.size() / points < kFewest) return fail("motion trace: fewer than four samples");
  if (trace.period <= Duration(0)) return fail("motion trace: no time goes by from sample to sample");
  if (!(trace.reach_mm > 0.0) || !std::isfinite(trace.reach_mm)) return fail("motion trace: it has no reach");
  const auto finite = [](const Vector3d& p) { return p.allFinite(); };
  if (!std::all_of(trace.places_W.begin(), trace.places_W.end(), finite) ||
      !std::all_of(trace.displacements_W.begin(), trace.displacements_W.end(), finite)) {
    return fail("motion trace: it is not made of finite numbers");
  }
  return {};
}

TracedPlace::TracedPlace(const SurfaceTrace& trace, Instant t) : trace_(trace), now_W_(trace.places_W.size()) {
  const std::size_t points = trace.places_W.size();
  const auto samples = static_cast<std::ptrdiff_t>(trace.displacements_W.size() / points);
  const double place =
      std::clamp(to_seconds(t - trace.first) / to_seconds(trace.period), 0.0, static_cast<double>(samples - 1));
  const auto before = std::min(static_cast<std::ptrdiff_t>(place), samples - 2);
  const double s = place - static_cast<double>(before);
  const std::array<double, 4> share{0.5 * s * (-1.0 + s * (2.0 - s)), 1.0 + 0.5 * s * s * (-5.0 + 3.0 * s),
                                    0.5 * s * (1.0 + s * (4.0 - 3.0 * s)), 0.5 * s * s * (s - 1.0)};
  for (std::size_t point = 0; point < points; ++point) {
    now_W_[point].setZero();
    for (std::ptrdiff_t k = 0; k < 4; ++k) {
      const auto sample = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(before + k - 1, 0, samples - 1));
      now_W_[point] += share[static_cast<std::size_t>(k)] * trace.displacements_W[sample * points + point];
    }
  }
}

Vector3d TracedPlace::displacement(const Vector3d& rest_W) const noexcept {
  // Against the nearest, so that far from all of them the nearest is what counts.
  double nearest2 = (rest_W - trace_.places_W.front()).squaredNorm();
  for (const Vector3d& place : trace_.places_W) nearest2 = std::min(nearest2, (rest_W - place).squaredNorm());
  Vector3d sum = Vector3d::Zero();
  double weights = 0.0;
  for (std::size_t point = 0; point < now_W_.size(); ++point) {
    const double distance2 = (rest_W - trace_.places_W[point]).squaredNorm();
    const double weight = std::exp(-0.5 * (distance2 - nearest2) / (trace_.reach_mm * trace_.reach_mm));
    sum += weight * now_W_[point];
    weights += weight;
  }
  return sum / weights;
}

}  // namespace perimap

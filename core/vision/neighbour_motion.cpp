#include "core/vision/neighbour_motion.hpp"

#include <array>
#include <cmath>

#include "core/statistics/nearest_few.hpp"
#include "core/statistics/upper_median.hpp"

namespace perimap {

void NeighbourMotion::add(const Vector2d& from_px, const Vector2d& to_px) noexcept {
  if (displacements_.size() < displacements_.capacity()) displacements_.push_back({from_px, to_px - from_px});
}

NeighbourMotion::Around NeighbourMotion::around(const Vector2d& px, const Vector2d* but) const noexcept {
  NearestFew<Vector2d, kNeighbours> nearest;
  for (const Displacement& displacement : displacements_) {
    if (but != nullptr && displacement.from == *but) continue;
    const double distance_squared = (displacement.from - px).squaredNorm();
    if (nearest.takes(distance_squared)) nearest.add(distance_squared, displacement.by);
  }
  const std::size_t count = nearest.size();
  Around result;
  if (count < kFewest) return result;
  result.known = true;
  for (std::size_t i = 0; i < count; ++i) {
    result.distance_px += std::sqrt(nearest[i].distance_squared) / static_cast<double>(count);
  }
  std::array<double, kNeighbours> values{};
  for (int axis = 0; axis < 2; ++axis) {
    for (std::size_t i = 0; i < count; ++i) values[i] = nearest[i].value[axis];
    result.by[axis] = upper_median(values.begin(), values.begin() + count);
  }
  for (std::size_t i = 0; i < count; ++i) values[i] = (nearest[i].value - result.by).norm();
  result.disagreement_px = upper_median(values.begin(), values.begin() + count);
  return result;
}

}  // namespace perimap

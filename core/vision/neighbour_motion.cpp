#include "core/vision/neighbour_motion.hpp"

#include <array>
#include <cmath>

#include "core/statistics/upper_median.hpp"

namespace perimap {

void NeighbourMotion::add(const Vector2d& from_px, const Vector2d& to_px) noexcept {
  if (displacements_.size() < displacements_.capacity()) displacements_.push_back({from_px, to_px - from_px});
}

NeighbourMotion::Around NeighbourMotion::around(const Vector2d& px, const Vector2d* but) const noexcept {
  struct Near {
    double distance_squared = 0;
    Vector2d by = Vector2d::Zero();
  };
  std::array<Near, kNeighbours> nearest;
  std::size_t count = 0;
  for (const Displacement& displacement : displacements_) {
    if (but != nullptr && displacement.from == *but) continue;
    const double distance_squared = (displacement.from - px).squaredNorm();
    if (count == kNeighbours && distance_squared >= nearest[count - 1].distance_squared) continue;
    std::size_t place = count < kNeighbours ? count++ : count - 1;
    for (; place > 0 && nearest[place - 1].distance_squared > distance_squared; --place) {
      nearest[place] = nearest[place - 1];
    }
    nearest[place] = {distance_squared, displacement.by};
  }
  Around result;
  if (count < kFewest) return result;
  result.known = true;
  for (std::size_t i = 0; i < count; ++i) {
    result.distance_px += std::sqrt(nearest[i].distance_squared) / static_cast<double>(count);
  }
  std::array<double, kNeighbours> values{};
  for (int axis = 0; axis < 2; ++axis) {
    for (std::size_t i = 0; i < count; ++i) values[i] = nearest[i].by[axis];
    result.by[axis] = upper_median(values.begin(), values.begin() + count);
  }
  for (std::size_t i = 0; i < count; ++i) values[i] = (nearest[i].by - result.by).norm();
  result.disagreement_px = upper_median(values.begin(), values.begin() + count);
  return result;
}

}  // namespace perimap

// Where a point was held still: the touches of a pointer's tip.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry/pose.hpp"

namespace perimap {

struct TimedPoint {
  double t_s = 0.0;
  Vector3d p = Vector3d::Zero();  // mm
};

struct Dwell {
  double begin_s = 0.0;
  double end_s = 0.0;
  Vector3d p = Vector3d::Zero();  // mean, mm
  double deviation_mm = 0.0;      // standard deviation of the mean, of its 3-D norm, for errors that last as these do
  std::size_t points = 0;
};

// Stretches of at least `shortest_s` in which the point, averaged over a quarter of a second, stays within `radius_mm`
// of one place. `points` in the order of their times; a gap of half a second ends a stretch. What is at the ends of a
// stretch, where the point still moves, does not count.
[[nodiscard]] std::vector<Dwell> find_dwells(const std::vector<TimedPoint>& points, double shortest_s,
                                             double radius_mm);

}  // namespace perimap

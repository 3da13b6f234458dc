// The place of a triangle that is nearest to a point.
#pragma once

#include <algorithm>
#include <array>

#include "core/geometry/pose.hpp"

namespace perimap {

// Shares of the corners a, b, c of the place that is nearest to p; they sum to 1, and none is negative. A triangle
// without an area is its longest side.
[[nodiscard]] inline Vector3d nearest_shares(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                                             const Vector3d& c) noexcept {
  const Vector3d ab = b - a, ac = c - a, ap = p - a;
  const double bb = ab.dot(ab), bc = ab.dot(ac), cc = ac.dot(ac), pb = ap.dot(ab), pc = ap.dot(ac);
  const double determinant = bb * cc - bc * bc;
  if (determinant > 0.0) {
    const double v = (cc * pb - bc * pc) / determinant;
    const double w = (bb * pc - bc * pb) / determinant;
    if (v >= 0.0 && w >= 0.0 && v + w <= 1.0) return {1.0 - v - w, v, w};
  }
  // Else on the nearest of its sides.
  const auto along = [](double part, double whole) { return whole > 0.0 ? std::clamp(part / whole, 0.0, 1.0) : 0.0; };
  const double on_ab = along(pb, bb), on_ac = along(pc, cc), on_bc = along((p - b).dot(c - b), (c - b).squaredNorm());
  const std::array<Vector3d, 3> sides = {Vector3d(1.0 - on_ab, on_ab, 0.0), Vector3d(1.0 - on_ac, 0.0, on_ac),
                                         Vector3d(0.0, 1.0 - on_bc, on_bc)};
  const auto distance = [&](const Vector3d& s) { return (s[0] * a + s[1] * b + s[2] * c - p).squaredNorm(); };
  return *std::min_element(sides.begin(), sides.end(),
                           [&](const Vector3d& s, const Vector3d& t) { return distance(s) < distance(t); });
}

}  // namespace perimap

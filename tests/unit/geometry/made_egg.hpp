// An egg of three different axes.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/geometry/triangle_mesh.hpp"

namespace perimap::test {

// Rings about the z axis; `cut`: rings left out at the top, so that it is open there. `bump` makes it no ellipsoid, so
// that each place is one.
inline TriangleMesh made_egg(int rings = 40, int spokes = 60, int cut = 0, const Vector3d& axes = {36.0, 44.0, 55.0},
                             double bump = 0.12) {
  TriangleMesh mesh;
  const auto place = [&](double latitude, double longitude) {
    const Vector3d u(std::sin(latitude) * std::cos(longitude), std::sin(latitude) * std::sin(longitude),
                     std::cos(latitude));
    const double r = 1.0 + bump * std::sin(3.0 * u.x() + 1.0) * std::cos(4.0 * u.y()) + 0.5 * bump * u.z() * u.x();
    return Vector3d(r * axes.cwiseProduct(u));
  };
  const int first = 1 + cut;
  for (int ring = first; ring < rings; ++ring) {
    for (int spoke = 0; spoke < spokes; ++spoke) {
      mesh.vertices.push_back(place(std::numbers::pi * ring / rings, 2.0 * std::numbers::pi * spoke / spokes));
    }
  }
  const auto at = [&](int ring, int spoke) {
    return static_cast<std::uint32_t>((ring - first) * spokes + spoke % spokes);
  };
  for (int ring = first; ring + 1 < rings; ++ring) {
    for (int spoke = 0; spoke < spokes; ++spoke) {
      mesh.triangles.push_back({at(ring, spoke), at(ring + 1, spoke), at(ring + 1, spoke + 1)});
      mesh.triangles.push_back({at(ring, spoke), at(ring + 1, spoke + 1), at(ring, spoke + 1)});
    }
  }
  const auto pole = [&](double latitude, int ring, bool top) {
    const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back(place(latitude, 0.0));
    for (int spoke = 0; spoke < spokes; ++spoke) {
      const std::uint32_t a = at(ring, spoke), b = at(ring, spoke + 1);
      mesh.triangles.push_back(top ? TriangleMesh::Triangle{middle, a, b} : TriangleMesh::Triangle{middle, b, a});
    }
  };
  if (cut == 0) pole(0.0, 1, true);
  pole(std::numbers::pi, rings - 1, false);
  return mesh;
}

}  // namespace perimap::test

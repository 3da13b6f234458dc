// The edges of a mesh, by the sides of its triangles.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

#include "core/geometry/triangle_mesh.hpp"

namespace perimap {

// A side of a triangle: from its corner `side` to the next.
struct MeshSide {
  std::uint32_t low = 0, high = 0;  // vertices
  std::uint32_t triangle = 0;
  std::uint32_t side = 0;
  bool rises = false;  // from the lower vertex to the higher one, as its triangle runs along it
};

// Calls visit(std::span<const MeshSide>) for each edge, in the order of its vertices, with the sides that lie on it in
// the order of their triangles: one at a border, two within.
template <class Visit>
void for_each_edge(std::span<const TriangleMesh::Triangle> triangles, const Visit& visit) {
  std::vector<MeshSide> sides;
  sides.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), t, k, a < b});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const MeshSide& a, const MeshSide& b) {
    return std::tie(a.low, a.high, a.triangle, a.side) < std::tie(b.low, b.high, b.triangle, b.side);
  });
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end].low == sides[i].low && sides[end].high == sides[i].high) ++end;
    visit(std::span<const MeshSide>(sides).subspan(i, end - i));
    i = end;
  }
}

}  // namespace perimap

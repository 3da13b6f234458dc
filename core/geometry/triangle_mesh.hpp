// A surface of triangles at rest.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/pose.hpp"

namespace perimap {

struct TriangleMesh {
  using Triangle = std::array<std::uint32_t, 3>;
  std::vector<Vector3d> vertices;   // mm
  std::vector<Triangle> triangles;  // vertices, counter-clockwise as seen from outside
};

// Outward, unit: of each vertex the mean of its triangles' by their areas. Zero where none has an area.
[[nodiscard]] std::vector<Vector3d> vertex_normals(const TriangleMesh& mesh);

// More of them are not taken from outside: a surface of an organ has a vertex a millimetre with a tenth of that.
inline constexpr std::size_t kMostTriangles = 2'000'000;

}  // namespace perimap

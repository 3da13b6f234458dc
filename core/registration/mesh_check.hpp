// Whether a mesh that came from outside is an organ's surface, before anything is fitted to it.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/triangle_mesh.hpp"

namespace perimap {

struct CheckedMesh {
  TriangleMesh mesh;                // each place is one vertex; no triangle without an area
  std::size_t border_edges = 0;     // with one triangle: 0 of a closed mesh
  std::size_t triangles_left = 0;   // out, since they have no area
  double size_mm = 0.0;             // diagonal of the box around it
  std::vector<std::string> doubts;  // what is odd of it in places, one line each
};

// Vertices at the same place become one. Refused, in words that say what and where: no triangle, or more than
// kMostTriangles; a vertex that is no number, or that is not there; lengths of another unit, by a size below 10 mm
// or above 1 m; edges with more than two triangles, or neighbours that face opposite sides, where more than one edge in
// a hundred is so (fewer are a doubt); triangles that face inwards, which is what a mirrored mesh has.
[[nodiscard]] Expected<CheckedMesh> check_mesh(TriangleMesh mesh);

}  // namespace perimap

// The nearest place of a mesh to a point.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/geometry/mesh_border.hpp"
#include "core/geometry/triangle_mesh.hpp"

namespace perimap {

struct NearestPlace {
  std::uint32_t triangle = 0;
  Vector3d shares = Vector3d::UnitX();  // of its corners
  Vector3d point = Vector3d::Zero();    // mm
  Vector3d normal = Vector3d::UnitZ();  // outward, unit: the corners' normals by their shares
  bool on_border = false;               // on an edge, or a corner, beyond which the mesh ends
};

// A tree of the triangles (Boost.Geometry's R-tree). The mesh is borrowed, and has a triangle; none is without an area.
class NearestTriangle {
 public:
  explicit NearestTriangle(const TriangleMesh& mesh);
  NearestTriangle(const NearestTriangle&) = delete;
  NearestTriangle& operator=(const NearestTriangle&) = delete;
  ~NearestTriangle();

  [[nodiscard]] NearestPlace to(const Vector3d& p) const;

 private:
  struct Tree;

  const TriangleMesh& mesh_;
  std::unique_ptr<const Tree> tree_;
  std::vector<Vector3d> normals_;  // of vertices, unit
  MeshBorder border_;
};

}  // namespace perimap

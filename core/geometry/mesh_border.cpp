#include "core/geometry/mesh_border.hpp"

#include "core/geometry/mesh_edges.hpp"

namespace perimap {

MeshBorder::MeshBorder(std::span<const TriangleMesh::Triangle> triangles, std::size_t vertices)
    : edges_(triangles.size(), 0), vertices_(vertices, 0) {
  for_each_edge(triangles, [this](std::span<const MeshSide> sides) {
    if (sides.size() != 1) return;
    edges_[sides[0].triangle] |= static_cast<std::uint8_t>(1U << sides[0].side);
    vertices_[sides[0].low] = vertices_[sides[0].high] = 1;
  });
}

bool MeshBorder::has(std::size_t triangle, const TriangleMesh::Triangle& corners,
                     const Vector3d& shares) const noexcept {
  for (std::size_t k = 0; k < 3; ++k) {
    if (shares[static_cast<Eigen::Index>(k)] >= 1.0) return vertices_[corners[k]] != 0;
    // The edge from corner k to the next is where the third corner has no share.
    const bool on_edge = shares[static_cast<Eigen::Index>((k + 2) % 3)] <= 0.0;
    if (on_edge && (edges_[triangle] >> k & 1U) != 0) return true;
  }
  return false;
}

}  // namespace perimap

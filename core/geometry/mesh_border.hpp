// Where a mesh ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/triangle_mesh.hpp"

namespace perimap {

// Found once for each mesh.
class MeshBorder {
 public:
  MeshBorder() = default;
  // Allocates. Every triangle's corners are below `vertices`.
  MeshBorder(std::span<const TriangleMesh::Triangle> triangles, std::size_t vertices);

  // Whether the place with these shares of a triangle's corners is on an edge, or a corner, beyond which there is no
  // triangle. `triangle` is its number, `corners` what it is made of.
  [[nodiscard]] bool has(std::size_t triangle, const TriangleMesh::Triangle& corners,
                         const Vector3d& shares) const noexcept;

 private:
  std::vector<std::uint8_t> edges_;     // of each triangle, bit k: from corner k to the next
  std::vector<std::uint8_t> vertices_;  // of each
};

}  // namespace perimap

#include "core/geometry/triangle_mesh.hpp"

#include <Eigen/Geometry>

namespace perimap {

std::vector<Vector3d> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Vector3d> normals(mesh.vertices.size(), Vector3d::Zero());
  for (const TriangleMesh::Triangle& triangle : mesh.triangles) {
    const Vector3d& a = mesh.vertices[triangle[0]];
    const Vector3d twice_area = (mesh.vertices[triangle[1]] - a).cross(mesh.vertices[triangle[2]] - a);
    for (const std::uint32_t vertex : triangle) normals[vertex] += twice_area;
  }
  for (Vector3d& normal : normals) normal.normalize();
  return normals;
}

}  // namespace perimap

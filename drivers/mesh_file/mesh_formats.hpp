// One reader a format. Coordinates are as the file has them.
#pragma once

#include <cstdint>
#include <span>

#include "core/error/expected.hpp"
#include "core/geometry/triangle_mesh.hpp"
#include "drivers/mesh_file/mesh_cursor.hpp"

namespace perimap {

[[nodiscard]] Expected<TriangleMesh> parse_binary_stl(MeshCursor at);
[[nodiscard]] Expected<TriangleMesh> parse_text_stl(MeshCursor at);
[[nodiscard]] Expected<TriangleMesh> parse_ply(MeshCursor at);
[[nodiscard]] Expected<TriangleMesh> parse_obj(MeshCursor at);
[[nodiscard]] Expected<TriangleMesh> parse_vtk(MeshCursor at);

// The polygon as a fan of triangles; false when one of its corners is no vertex of `vertices`, or there are too many
// triangles (kMostTriangles).
enum class AddedPolygon : std::uint8_t { kAdded, kNoVertex, kTooMany };
[[nodiscard]] AddedPolygon add_polygon(std::span<const std::int64_t> corners, std::size_t vertices, TriangleMesh& mesh);

// What a file says that has more triangles than are taken.
[[nodiscard]] std::string too_many_triangles();

}  // namespace perimap

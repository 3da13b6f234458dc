// Surfaces of triangles as files: STL, PLY, OBJ and legacy VTK, as segmentations are exported.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"
#include "core/geometry/triangle_mesh.hpp"

namespace perimap {

// By what the file begins with, and OBJ, which begins anyhow, by its ending. STL, PLY and VTK (POLYDATA) as text or
// binary. Polygons become fans of triangles; colours, normals, textures and groups are passed over. Coordinates are
// multiplied by `unit_mm`. Errors name file and line or byte; vertices are finite, and triangles name vertices that
// are there. There may be no triangle, and the mesh may be anything else: check_mesh() judges that.
[[nodiscard]] Expected<TriangleMesh> parse_mesh(std::string_view bytes, std::string_view name, double unit_mm);
// A file of 512 MiB at most.
[[nodiscard]] Expected<TriangleMesh> read_mesh(const std::filesystem::path& file, double unit_mm);

// As PLY, text; coordinates in the mesh's own unit.
[[nodiscard]] std::string ply_text(const TriangleMesh& mesh);

}  // namespace perimap

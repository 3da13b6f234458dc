// Wavefront OBJ: what of it is a surface, `v` and `f` (Wavefront, Advanced Visualizer Manual, appendix B1).
#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "drivers/mesh_file/mesh_formats.hpp"

namespace perimap {
namespace {

constexpr std::size_t kMostVertices = 3 * kMostTriangles;

// Words of one line.
std::string_view next_word(std::string_view& line) noexcept {
  const std::size_t begin = std::min(line.find_first_not_of(" \t"), line.size());
  const std::size_t end = std::min(line.find_first_of(" \t", begin), line.size());
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

Expected<void> add_vertex(std::string_view line, const MeshCursor& at, TriangleMesh& mesh) {
  if (mesh.vertices.size() >= kMostVertices) return at.wrong_file(too_many_triangles());
  Vector3d p = Vector3d::Zero();
  for (double& x : p) {
    const auto value = at.real_of(next_word(line), "a coordinate");
    if (!value) return tl::unexpected(value.error());
    x = *value;
  }
  mesh.vertices.push_back(p);  // a weight or a colour may follow
  return {};
}

// Corners as v, v/vt, v//vn or v/vt/vn; counted from 1, or from the last one backwards where they are negative.
Expected<void> add_face(std::string_view line, const MeshCursor& at, TriangleMesh& mesh) {
  std::vector<std::int64_t> corners;
  for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
    const auto index = at.integer_of(word.substr(0, word.find('/')), "a vertex of a face");
    if (!index) return tl::unexpected(index.error());
    const auto there = static_cast<std::int64_t>(mesh.vertices.size());
    corners.push_back(*index > 0 ? *index - 1 : *index < 0 && *index >= -there ? there + *index : -1);
  }
  if (corners.size() < 3)
    return at.wrong_line(fmt::format("a face has {} corners, expected three and more", corners.size()));
  switch (add_polygon(corners, mesh.vertices.size(), mesh)) {
    case AddedPolygon::kAdded:
      return {};
    case AddedPolygon::kNoVertex:
      return at.wrong_line(
          fmt::format("a face has a vertex that is not there: {} were before it", mesh.vertices.size()));
    case AddedPolygon::kTooMany:
      break;
  }
  return at.wrong_file(too_many_triangles());
}

}  // namespace

Expected<TriangleMesh> parse_obj(MeshCursor at) {
  TriangleMesh mesh;
  while (!at.at_end()) {
    std::string_view line = at.line();
    const std::string_view kind = next_word(line);
    Expected<void> added;
    if (kind == "v") added = add_vertex(line, at, mesh);
    if (kind == "f") added = add_face(line, at, mesh);
    if (!added) return tl::unexpected(added.error());
  }
  return mesh;
}

}  // namespace perimap

// STL: 3D Systems, Stereolithography Interface Specification, 1988. Each triangle has corners of its own.
#include <fmt/format.h>

#include "drivers/mesh_file/mesh_formats.hpp"

namespace perimap {
namespace {

constexpr std::size_t kHeader_bytes = 80;

void add_triangle_of_last_three(TriangleMesh& mesh) {
  const auto n = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.triangles.push_back({n - 3, n - 2, n - 1});
}

}  // namespace

Expected<TriangleMesh> parse_binary_stl(MeshCursor at) {
  static_cast<void>(at.skip(kHeader_bytes));
  const auto count = at.raw<std::uint32_t>(false);
  if (!count) return at.wrong_byte("ends before the number of its triangles");
  if (*count > kMostTriangles) return at.wrong_file(fmt::format("says {}: {}", *count, too_many_triangles()));
  TriangleMesh mesh;
  for (std::uint32_t t = 0; t < *count; ++t) {
    if (!at.skip(3 * sizeof(float))) return at.wrong_byte("ends within a triangle");  // its normal
    for (int corner = 0; corner < 3; ++corner) {
      Vector3d p = Vector3d::Zero();
      for (double& x : p) {
        const auto value = at.raw<float>(false);
        if (!value) return at.wrong_byte("ends within a triangle");
        x = static_cast<double>(*value);
      }
      if (!p.allFinite()) return at.wrong_byte(fmt::format("a corner of triangle {} is no number", t));
      mesh.vertices.push_back(p);
    }
    if (!at.skip(sizeof(std::uint16_t))) return at.wrong_byte("ends within a triangle");
    add_triangle_of_last_three(mesh);
  }
  return mesh;
}

Expected<TriangleMesh> parse_text_stl(MeshCursor at) {
  static_cast<void>(at.line());  // solid, and a name of any words
  TriangleMesh mesh;
  for (;;) {
    std::string_view word = at.word();
    if (word.empty()) return at.wrong_line("ends without 'endsolid': it was perhaps cut");
    if (word == "endsolid") {
      static_cast<void>(at.line());
      // Another one may follow.
      if (word = at.word(); word.empty()) return mesh;
      if (word != "solid")
        return at.wrong_line(fmt::format("expected 'solid' or the file's end, got: {}", quoted(word)));
      static_cast<void>(at.line());
      continue;
    }
    if (word != "facet") return at.wrong_line(fmt::format("expected 'facet' or 'endsolid', got: {}", quoted(word)));
    static_cast<void>(at.line());  // its normal
    if (mesh.triangles.size() >= kMostTriangles) return at.wrong_file(too_many_triangles());
    for (const std::string_view expected : {"outer", "loop"}) {
      if (word = at.word(); word != expected) {
        return at.wrong_line(fmt::format("expected 'outer loop', got: {}", quoted(word)));
      }
    }
    for (int corner = 0; corner < 3; ++corner) {
      if (word = at.word(); word != "vertex") {
        return at.wrong_line(fmt::format("expected 'vertex', got: {}", quoted(word)));
      }
      Vector3d p = Vector3d::Zero();
      for (double& x : p) {
        const auto value = at.real("a coordinate");
        if (!value) return tl::unexpected(value.error());
        x = *value;
      }
      mesh.vertices.push_back(p);
    }
    add_triangle_of_last_three(mesh);
    for (const std::string_view expected : {"endloop", "endfacet"}) {
      if (word = at.word(); word != expected) {
        return at.wrong_line(fmt::format("expected '{}', got: {}", expected, quoted(word)));
      }
    }
  }
}

}  // namespace perimap

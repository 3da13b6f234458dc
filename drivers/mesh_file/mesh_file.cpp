#include "drivers/mesh_file/mesh_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <iterator>

#include "drivers/mesh_file/mesh_formats.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr std::size_t kLargestFile = std::size_t{512} << 20;

bool ends_with(std::string_view name, std::string_view ending) {
  return name.size() >= ending.size() && std::equal(ending.rbegin(), ending.rend(), name.rbegin(), [](char a, char b) {
           return a == std::tolower(static_cast<unsigned char>(b));
         });
}

// A header of 80 bytes, the number of triangles, and 50 bytes for each: nothing else tells it from text that begins
// with "solid", as many such headers do.
bool is_binary_stl(std::string_view bytes) {
  if (bytes.size() < 84) return false;
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, sizeof count);
  return bytes.size() == 84 + std::uint64_t{50} * count;
}

Expected<TriangleMesh> parsed(std::string_view bytes, std::string_view name) {
  const MeshCursor at(name, bytes);
  if (bytes.empty()) return at.wrong_file("is empty");
  if (bytes.starts_with("ply")) return parse_ply(at);
  if (bytes.starts_with("# vtk DataFile")) return parse_vtk(at);
  if (is_binary_stl(bytes)) return parse_binary_stl(at);
  if (bytes.starts_with("solid")) return parse_text_stl(at);
  if (ends_with(name, ".obj")) return parse_obj(at);
  if (ends_with(name, ".stl")) {
    return at.wrong_file(
        fmt::format("is neither STL as text, which begins with 'solid', nor binary, whose size follows "
                    "from its number of triangles: it has {} bytes, and was perhaps cut",
                    bytes.size()));
  }
  return at.wrong_file("expected a surface as STL, PLY, OBJ (named .obj) or legacy VTK");
}

}  // namespace

AddedPolygon add_polygon(std::span<const std::int64_t> corners, std::size_t vertices, TriangleMesh& mesh) {
  for (const std::int64_t corner : corners) {
    if (corner < 0 || static_cast<std::uint64_t>(corner) >= vertices) return AddedPolygon::kNoVertex;
  }
  for (std::size_t k = 2; k < corners.size(); ++k) {
    if (mesh.triangles.size() >= kMostTriangles) return AddedPolygon::kTooMany;
    mesh.triangles.push_back({static_cast<std::uint32_t>(corners[0]), static_cast<std::uint32_t>(corners[k - 1]),
                              static_cast<std::uint32_t>(corners[k])});
  }
  return AddedPolygon::kAdded;
}

std::string too_many_triangles() {
  return fmt::format("has more than {} triangles: reduce it, a millimetre between vertices is enough", kMostTriangles);
}

Expected<TriangleMesh> parse_mesh(std::string_view bytes, std::string_view name, double unit_mm) {
  auto mesh = parsed(bytes, name);
  if (!mesh) return mesh;
  for (std::size_t v = 0; v < mesh->vertices.size(); ++v) {
    mesh->vertices[v] *= unit_mm;
    if (!mesh->vertices[v].allFinite()) {
      return MeshCursor(name, bytes).wrong_file(fmt::format("vertex {} (the first one is 0) is no number", v));
    }
  }
  return mesh;
}

Expected<TriangleMesh> read_mesh(const std::filesystem::path& file, double unit_mm) {
  const auto bytes = read_text_file(file, kLargestFile, "surface");
  if (!bytes) return tl::unexpected(bytes.error());
  if (bytes->size() > kLargestFile) {
    return MeshCursor(file.string(), "")
        .wrong_file(fmt::format("is larger than {} MiB: reduce it", kLargestFile >> 20U));
  }
  return parse_mesh(*bytes, file.string(), unit_mm);
}

std::string ply_text(const TriangleMesh& mesh) {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\nelement face "
      "{}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.vertices.size(), mesh.triangles.size());
  for (const Vector3d& p : mesh.vertices) {
    fmt::format_to(std::back_inserter(text), "{:.6f} {:.6f} {:.6f}\n", p.x(), p.y(), p.z());
  }
  for (const auto& [a, b, c] : mesh.triangles) fmt::format_to(std::back_inserter(text), "3 {} {} {}\n", a, b, c);
  return text;
}

}  // namespace perimap

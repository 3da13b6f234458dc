#include "core/registration/mesh_check.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include "core/geometry/mesh_edges.hpp"

namespace perimap {
namespace {

constexpr double kSmallest_mm = 10.0;
constexpr double kLargest_mm = 1000.0;
constexpr double kMostOdd = 0.01;  // share of the edges

std::string place_text(const Vector3d& p) {
  std::array<char, 96> text{};
  (void)std::snprintf(text.data(), text.size(), "(%.1f, %.1f, %.1f)", p.x(), p.y(), p.z());
  return text.data();
}

std::string length_text(double mm) {
  std::array<char, 64> text{};
  const bool metres = mm >= 1000.0;
  (void)std::snprintf(text.data(), text.size(), metres ? "%.3g m" : "%.3g mm", metres ? 1e-3 * mm : mm);
  return text.data();
}

std::optional<Error> wrong_number(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return Error{"has no triangle"};
  if (mesh.triangles.size() > kMostTriangles) {
    return Error{"has " + std::to_string(mesh.triangles.size()) + " triangles, and at most " +
                 std::to_string(kMostTriangles) + " are taken: reduce it, a millimetre between vertices is enough"};
  }
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!mesh.vertices[v].allFinite()) return Error{"vertex " + std::to_string(v) + " is no number"};
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t vertex : mesh.triangles[t]) {
      if (vertex >= mesh.vertices.size()) {
        return Error{"triangle " + std::to_string(t) + " has vertex " + std::to_string(vertex) + ", and there are " +
                     std::to_string(mesh.vertices.size())};
      }
    }
  }
  return std::nullopt;
}

// Formats without topology (STL) repeat each vertex for each triangle.
void weld(TriangleMesh& mesh) {
  std::vector<std::uint32_t> order(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto key = [&](std::uint32_t v) {
    const Vector3d& p = mesh.vertices[v];
    return std::array<double, 3>{p.x(), p.y(), p.z()};
  };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const auto of_a = key(a), of_b = key(b);
    return of_a != of_b ? of_a < of_b : a < b;
  });
  // The first of each place stands for all of it, so that the order of the file stays.
  std::vector<std::uint32_t> first(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && key(order[i]) == key(order[i - 1]);
    first[order[i]] = same ? first[order[i - 1]] : order[i];
  }
  std::vector<Vector3d> vertices;
  std::vector<std::uint32_t> becomes(first.size());
  for (std::uint32_t v = 0; v < first.size(); ++v) {
    if (first[v] == v) {
      becomes[v] = static_cast<std::uint32_t>(vertices.size());
      vertices.push_back(mesh.vertices[v]);
    } else {
      becomes[v] = becomes[first[v]];
    }
  }
  mesh.vertices = std::move(vertices);
  for (auto& triangle : mesh.triangles) {
    for (std::uint32_t& vertex : triangle) vertex = becomes[vertex];
  }
}

Vector3d doubled_area(const TriangleMesh& mesh, const TriangleMesh::Triangle& triangle) {
  const Vector3d& a = mesh.vertices[triangle[0]];
  return (mesh.vertices[triangle[1]] - a).cross(mesh.vertices[triangle[2]] - a);
}

struct Edges {
  std::size_t all = 0, border = 0, crowded = 0, turned = 0;
  MeshSide first_crowded, first_turned;
};

Edges count_edges(const TriangleMesh& mesh) {
  Edges edges;
  for_each_edge(mesh.triangles, [&edges](std::span<const MeshSide> sides) {
    ++edges.all;
    if (sides.size() == 1) ++edges.border;
    if (sides.size() > 2 && edges.crowded++ == 0) edges.first_crowded = sides[0];
    if (sides.size() == 2 && sides[0].rises == sides[1].rises && edges.turned++ == 0) edges.first_turned = sides[0];
  });
  return edges;
}

std::string edge_place(const TriangleMesh& mesh, const MeshSide& edge) {
  return "from " + place_text(mesh.vertices[edge.low]) + " to " + place_text(mesh.vertices[edge.high]) + " mm";
}

// Of a closed mesh; of an open one about what it has with its holes closed towards its middle.
double volume_mm3(const TriangleMesh& mesh, double& unsigned_mm3) {
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& p : mesh.vertices) middle += p / static_cast<double>(mesh.vertices.size());
  double volume = 0.0;
  unsigned_mm3 = 0.0;
  for (const auto& triangle : mesh.triangles) {
    const double part = doubled_area(mesh, triangle).dot(mesh.vertices[triangle[0]] - middle) / 6.0;
    volume += part;
    unsigned_mm3 += std::abs(part);
  }
  return volume;
}

std::optional<Error> wrong_size(double size_mm) {
  if (size_mm < kSmallest_mm) {
    return Error{"is " + length_text(size_mm) + " large: are its lengths in metres? Then its unit is m"};
  }
  if (size_mm > kLargest_mm) {
    return Error{"is " + length_text(size_mm) + " large: are its lengths in mm? Then its unit is mm"};
  }
  return std::nullopt;
}

// Few of them are a doubt, many refuse the mesh.
std::optional<Error> judge_odd_edges(std::size_t count, std::size_t all, const std::string& text,
                                     CheckedMesh& checked) {
  if (count == 0) return std::nullopt;
  if (static_cast<double>(count) > kMostOdd * static_cast<double>(all)) return Error{text};
  checked.doubts.push_back(text);
  return std::nullopt;
}

std::optional<Error> judge_edges(const Edges& edges, CheckedMesh& checked) {
  const auto of = [&](std::size_t count) {
    return std::to_string(count) + " of " + std::to_string(edges.all) + " edges";
  };
  const std::string crowded = "is no manifold: " + of(edges.crowded) + " have more than two triangles, the first one ";
  if (auto wrong =
          judge_odd_edges(edges.crowded, edges.all, crowded + edge_place(checked.mesh, edges.first_crowded), checked)) {
    return wrong;
  }
  const std::string turned = "at " + of(edges.turned) + " both triangles face opposite sides, the first one ";
  return judge_odd_edges(edges.turned, edges.all, turned + edge_place(checked.mesh, edges.first_turned), checked);
}

}  // namespace

Expected<CheckedMesh> check_mesh(TriangleMesh mesh) {
  if (auto wrong = wrong_number(mesh)) return tl::unexpected(*std::move(wrong));
  weld(mesh);
  CheckedMesh checked;
  checked.triangles_left =
      std::erase_if(mesh.triangles, [&](const auto& triangle) { return !(doubled_area(mesh, triangle).norm() > 0.0); });
  if (mesh.triangles.empty()) return fail("has no triangle with an area");
  Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity());
  Vector3d high = -low;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t vertex : triangle) {
      low = low.cwiseMin(mesh.vertices[vertex]);
      high = high.cwiseMax(mesh.vertices[vertex]);
    }
  }
  checked.size_mm = (high - low).norm();
  if (auto wrong = wrong_size(checked.size_mm)) return tl::unexpected(*std::move(wrong));
  checked.mesh = std::move(mesh);
  const Edges edges = count_edges(checked.mesh);
  checked.border_edges = edges.border;
  if (auto wrong = judge_edges(edges, checked)) return tl::unexpected(*std::move(wrong));
  double unsigned_mm3 = 0.0;
  if (volume_mm3(checked.mesh, unsigned_mm3) < -0.25 * unsigned_mm3) {
    return fail("its triangles face inwards: it is mirrored, or inside out; export it anew");
  }
  return checked;
}

}  // namespace perimap

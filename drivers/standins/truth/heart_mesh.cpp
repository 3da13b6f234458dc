#include "drivers/standins/truth/heart_mesh.hpp"

#include <cmath>
#include <utility>

#include "drivers/text_file/csv.hpp"

namespace perimap {

std::vector<double> fourier_basis(double phase_rad, std::uint32_t harmonics) {
  std::vector<double> basis(1 + 2 * std::size_t{harmonics});
  basis[0] = 1.0;
  for (std::uint32_t k = 1; k <= harmonics; ++k) {
    basis[k] = std::cos(k * phase_rad);
    basis[harmonics + k] = -std::sin(k * phase_rad);
  }
  return basis;
}

Vector3d vertex_position(const HeartMesh& mesh, std::span<const double> basis, std::uint32_t vertex) noexcept {
  const std::size_t n = basis.size();
  const double* coefficients = mesh.coefficients_mm.data() + std::size_t{vertex} * 3 * n;
  Vector3d p = Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) sum += coefficients[i] * basis[i];
    p[axis] = sum;
    coefficients += n;
  }
  return p;
}

void vertex_positions(const HeartMesh& mesh, std::span<const double> basis, std::span<Vector3d> out) noexcept {
  for (std::uint32_t vertex = 0; vertex < mesh.vertex_count; ++vertex)
    out[vertex] = vertex_position(mesh, basis, vertex);
}

TriangleMesh surface_with(const HeartMesh& mesh, std::vector<Vector3d> vertices) {
  TriangleMesh surface{std::move(vertices), {}};
  surface.triangles.reserve(mesh.triangles.size() / 3);
  for (std::size_t i = 0; i + 2 < mesh.triangles.size(); i += 3) {
    surface.triangles.push_back({mesh.triangles[i], mesh.triangles[i + 1], mesh.triangles[i + 2]});
  }
  return surface;
}

TriangleMesh surface_at(const HeartMesh& mesh, double phase_rad) {
  std::vector<Vector3d> vertices(mesh.vertex_count);
  vertex_positions(mesh, fourier_basis(phase_rad, mesh.harmonics), vertices);
  return surface_with(mesh, std::move(vertices));
}

HeartMesh transformed(const Pose& X_AB, HeartMesh mesh_B) {
  const std::size_t n = mesh_B.coefficients_per_axis();
  for (std::size_t vertex = 0; vertex < mesh_B.vertex_count; ++vertex) {
    double* coefficients = mesh_B.coefficients_mm.data() + vertex * 3 * n;
    for (std::size_t i = 0; i < n; ++i) {
      const Vector3d c_B(coefficients[i], coefficients[n + i], coefficients[2 * n + i]);
      const Vector3d c_A = i == 0 ? X_AB * c_B : Vector3d(X_AB.R * c_B);
      for (std::size_t axis = 0; axis < 3; ++axis) coefficients[axis * n + i] = c_A[static_cast<Eigen::Index>(axis)];
    }
  }
  return mesh_B;
}

HeartMesh at_rest(const HeartMesh& mesh) {
  HeartMesh still{mesh.vertex_count, 0, {}, mesh.triangles};
  const std::size_t axis = mesh.coefficients_per_axis();
  for (std::size_t i = 0; i < mesh.coefficients_mm.size(); i += axis) {
    still.coefficients_mm.push_back(mesh.coefficients_mm[i]);
  }
  return still;
}

Expected<void> check(const HeartMesh& mesh) {
  const std::size_t expected = std::size_t{mesh.vertex_count} * 3 * mesh.coefficients_per_axis();
  if (mesh.coefficients_mm.size() != expected) {
    return fail("heart mesh: " + std::to_string(mesh.vertex_count) + " vertices with " +
                std::to_string(mesh.harmonics) + " harmonics need " + std::to_string(expected) +
                " coefficients, found " + std::to_string(mesh.coefficients_mm.size()));
  }
  if (mesh.triangles.empty() || mesh.triangles.size() % 3 != 0)
    return fail("heart mesh: " + std::to_string(mesh.triangles.size()) + " triangle indices, expected a multiple of 3");
  for (const std::uint32_t vertex : mesh.triangles) {
    if (vertex >= mesh.vertex_count) {
      return fail("heart mesh: triangle index " + std::to_string(vertex) + " is not below the vertex count " +
                  std::to_string(mesh.vertex_count));
    }
  }
  for (const double coefficient : mesh.coefficients_mm)
    if (!std::isfinite(coefficient)) return fail("heart mesh: a coefficient is not finite");
  return {};
}

Expected<HeartMesh> parse_heart_mesh(std::string_view fourier_csv, std::string_view faces_csv) {
  constexpr std::uint32_t kHarmonics = 4;
  HeartMesh mesh;
  mesh.harmonics = kHarmonics;

  CsvCursor rows("epi_fourier_H4.csv", fourier_csv);
  if (!rows.next_line()) return rows.wrong("the table is empty");
  std::uint32_t row = 0;
  for (; rows.next_line(); ++row) {
    const auto vertex = rows.number<std::uint32_t>();
    if (!vertex) return tl::unexpected(vertex.error());
    const std::string_view axis = rows.field();
    if (*vertex != row / 3 || axis != std::string_view("xyz").substr(row % 3, 1))
      return rows.wrong("expected the vertices in order, axes x, y, z of each");
    double c[1 + 2 * kHarmonics] = {};
    for (double& value : c) {
      const auto number = rows.number<double>();
      if (!number) return tl::unexpected(number.error());
      value = *number;
    }
    mesh.coefficients_mm.push_back(c[0]);
    for (std::uint32_t k = 1; k <= kHarmonics; ++k) mesh.coefficients_mm.push_back(c[2 * k - 1]);
    for (std::uint32_t k = 1; k <= kHarmonics; ++k) mesh.coefficients_mm.push_back(-c[2 * k]);
  }
  if (row % 3 != 0) return rows.wrong("the last vertex is not whole");
  mesh.vertex_count = row / 3;

  CsvCursor faces("epi_faces.csv", faces_csv);
  if (!faces.next_line()) return faces.wrong("the table is empty");
  while (faces.next_line()) {
    for (int i = 0; i < 3; ++i) {
      const auto vertex = faces.number<std::uint32_t>();
      if (!vertex) return tl::unexpected(vertex.error());
      mesh.triangles.push_back(*vertex);
    }
  }
  if (const auto good = check(mesh); !good) return tl::unexpected(good.error());
  return mesh;
}

}  // namespace perimap

// A closed or open triangle surface whose vertices move on Fourier series of one phase.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"
#include "core/geometry/triangle_mesh.hpp"

namespace perimap {

// p(phi) = DC + sum_k a_k cos(k phi) - b_k sin(k phi), mm. The layout is that of the recorded truth mesh.
struct HeartMesh {
  std::uint32_t vertex_count = 0;
  std::uint32_t harmonics = 0;
  std::vector<double> coefficients_mm;   // per vertex: axis x, y, z: DC, a_1..a_H, b_1..b_H
  std::vector<std::uint32_t> triangles;  // vertex indices, three a triangle, outward side counter-clockwise

  [[nodiscard]] std::size_t coefficients_per_axis() const noexcept { return 1 + 2 * std::size_t{harmonics}; }
};

// [1, cos phi .. cos H phi, -sin phi .. -sin H phi].
[[nodiscard]] std::vector<double> fourier_basis(double phase_rad, std::uint32_t harmonics);

// Position of one vertex, given the basis at the phase.
[[nodiscard]] Vector3d vertex_position(const HeartMesh& mesh, std::span<const double> basis,
                                       std::uint32_t vertex) noexcept;

// Positions of all vertices; `out` has vertex_count places.
void vertex_positions(const HeartMesh& mesh, std::span<const double> basis, std::span<Vector3d> out) noexcept;

// The surface with these places of the vertices, one for each.
[[nodiscard]] TriangleMesh surface_with(const HeartMesh& mesh, std::vector<Vector3d> vertices);
// The surface at a phase.
[[nodiscard]] TriangleMesh surface_at(const HeartMesh& mesh, double phase_rad);

// The same mesh with its coordinates mapped by X_AB from frame B to frame A.
[[nodiscard]] HeartMesh transformed(const Pose& X_AB, HeartMesh mesh_B);

// The same mesh as it is without its beating: the series' constant terms.
[[nodiscard]] HeartMesh at_rest(const HeartMesh& mesh);

// Sizes agree and every index names a vertex; the error names what does not.
[[nodiscard]] Expected<void> check(const HeartMesh& mesh);

// From the project's own tables (drivers/standins/simulator/data/README.md). Their sine terms have the opposite sign of
// ours.
[[nodiscard]] Expected<HeartMesh> parse_heart_mesh(std::string_view fourier_csv, std::string_view faces_csv);

}  // namespace perimap

#include "core/registration/surface_points.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "core/geometry/mesh_edges.hpp"

namespace perimap {
namespace {

Eigen::Matrix3Xd evaluated(const SurfaceMesh& mesh, const Basis& b) {
  const Eigen::VectorXd flat = mesh.coefficients_W_mm * b;
  return Eigen::Map<const Eigen::Matrix3Xd>(flat.data(), 3, flat.size() / 3);
}

// Twice its area, along its normal.
Vector3d doubled_area(const Eigen::Matrix3Xd& p, const std::array<std::uint32_t, 3>& triangle) {
  const Vector3d a = p.col(triangle[0]);
  return (p.col(triangle[1]) - a).cross(p.col(triangle[2]) - a);
}

// The ends of edges that have one triangle; each comes more than once.
std::vector<Eigen::Index> border_of(const SurfaceMesh& mesh) {
  std::vector<Eigen::Index> border;
  for_each_edge(mesh.triangles, [&border](std::span<const MeshSide> sides) {
    if (sides.size() == 1) border.insert(border.end(), {sides[0].low, sides[0].high});
  });
  return border;
}

}  // namespace

SurfacePoints points_at(const SurfaceMesh& mesh, double cardiac_phase_rad) {
  const Eigen::Matrix3Xd positions = evaluated(mesh, basis_without_breath(mesh.layout, cardiac_phase_rad));
  const Eigen::Matrix3Xd rates = evaluated(mesh, basis_rate(mesh.layout, cardiac_phase_rad));
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, positions.cols());
  for (const auto& triangle : mesh.triangles) {
    const Vector3d normal = doubled_area(positions, triangle);
    for (const std::uint32_t vertex : triangle) normals.col(vertex) += normal;
  }
  const std::vector<Eigen::Index> border = border_of(mesh);
  const auto is_on_rim = [&](Eigen::Index v) {
    return std::any_of(border.begin(), border.end(), [&](Eigen::Index b) {
      return (positions.col(v) - positions.col(b)).squaredNorm() < kSurfaceRim_mm * kSurfaceRim_mm;
    });
  };
  std::vector<Eigen::Index> kept;
  for (Eigen::Index v = 0; v < positions.cols(); ++v) {
    if (normals.col(v).norm() > 0.0 && !is_on_rim(v)) kept.push_back(v);
  }
  const auto N = static_cast<Eigen::Index>(kept.size());
  SurfacePoints points{Eigen::Matrix3Xd(3, N), Eigen::Matrix3Xd(3, N), Eigen::Matrix3Xd(3, N),
                       Eigen::Matrix<double, 6, Eigen::Dynamic>(6, N)};
  for (Eigen::Index i = 0; i < N; ++i) {
    const Eigen::Index v = kept[static_cast<std::size_t>(i)];
    points.positions_W_mm.col(i) = positions.col(v);
    points.normals_W.col(i) = normals.col(v).normalized();
    points.rates_W_mm_per_rad.col(i) = rates.col(v);
    points.covariances_W_mm2.col(i) = mesh.covariances_W_mm2.col(v);
  }
  return points;
}

double feature_spacing_mm(const SurfaceMesh& mesh, std::size_t features) {
  const Eigen::Matrix3Xd positions = evaluated(mesh, basis_without_breath(mesh.layout, 0.0));
  double area_mm2 = 0.0;
  for (const auto& triangle : mesh.triangles) area_mm2 += 0.5 * doubled_area(positions, triangle).norm();
  return std::sqrt(area_mm2 / static_cast<double>(std::max<std::size_t>(features, 1)));
}

double common_share_of(double leave_one_out_nees) noexcept {
  return std::isfinite(leave_one_out_nees) ? std::clamp(1.0 - leave_one_out_nees, 0.0, 1.0) : 0.0;
}

}  // namespace perimap

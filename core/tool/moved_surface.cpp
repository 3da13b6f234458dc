#include "core/tool/moved_surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/geometry/nearest_shares.hpp"
#include "core/pipeline/phase_basis.hpp"
#include "core/pipeline/phase_spread.hpp"

namespace perimap {

MovedSurface::MovedSurface(std::size_t vertices) : positions_(static_cast<Eigen::Index>(3 * vertices)) {}

void MovedSurface::move(const SurfaceMesh& mesh, const PhaseEstimate& phase,
                        const RespiratoryPhase& respiration) noexcept {
  mesh_ = &mesh;
  const BasisLayout& layout = mesh.layout;
  b_ = basis_at(layout, phase.phase_rad, respiration);
  const BasesAbout about = bases_about(layout, phase, respiration);
  earlier_ = about.earlier - b_;
  later_ = about.later - b_;
  rate_ = phase.rate_rad_per_s * basis_rate(layout, phase.phase_rad);
  if (respiration.known) rate_ += respiration.rate_rad_per_s * breath_rate(layout, respiration.phase_rad);
  breath_mm2_ = respiration.deviation_mm * respiration.deviation_mm;
  const Eigen::Index rows = 3 * mesh.vertices();
  if (positions_.size() < rows) positions_.resize(rows);
  auto p = positions_.head(rows);
  p.setZero();
  for (Eigen::Index j = 0; j < b_.size(); ++j) p += b_(j) * mesh.coefficients_W_mm.col(j);
}

// Of the corners, each the sum of its triangles' weighted by their areas, by their shares.
Vector3d MovedSurface::normal_at(std::size_t triangle, const Vector3d& shares) const noexcept {
  const auto& asked = mesh_->triangles[triangle];
  std::array<Vector3d, 3> normals = {Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
  for (const auto& corners : mesh_->triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (std::find(corners.begin(), corners.end(), asked[k]) == corners.end()) continue;
      const Vector3d a = position(corners[0]);
      normals[k] += (position(corners[1]) - a).cross(position(corners[2]) - a);
    }
  }
  Vector3d normal = Vector3d::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    normal += shares[static_cast<Eigen::Index>(k)] * normals[k].stableNormalized();
  }
  return normal.stableNormalized();
}

double MovedSurface::variance_along(std::uint32_t vertex, const Vector3d& n) const noexcept {
  const auto six = mesh_->covariances_W_mm2.col(static_cast<Eigen::Index>(vertex));
  const auto c = mesh_->coefficients_W_mm.middleRows<3>(static_cast<Eigen::Index>(3 * vertex));
  const double before = n.dot(c * earlier_);
  const double after = n.dot(c * later_);
  return n.x() * n.x() * six(0) + n.y() * n.y() * six(3) + n.z() * n.z() * six(5) +
         2.0 * (n.x() * n.y() * six(1) + n.x() * n.z() * six(2) + n.y() * n.z() * six(4)) +
         0.5 * (before * before + after * after) + breath_mm2_;
}

PlaceOnSurface MovedSurface::nearest(const MeshBorder& border, const Vector3d& p_W_mm) const noexcept {
  PlaceOnSurface place;
  if (mesh_ == nullptr || mesh_->triangles.empty() || !p_W_mm.allFinite()) return place;
  double least = std::numeric_limits<double>::infinity();
  std::size_t best = 0;
  Vector3d shares = Vector3d::UnitX();
  for (std::size_t t = 0; t < mesh_->triangles.size(); ++t) {
    const auto& corners = mesh_->triangles[t];
    const Vector3d a = position(corners[0]), b = position(corners[1]), c = position(corners[2]);
    const Vector3d s = nearest_shares(p_W_mm, a, b, c);
    const double d2 = (s[0] * a + s[1] * b + s[2] * c - p_W_mm).squaredNorm();
    if (!(d2 < least)) continue;
    least = d2;
    best = t;
    shares = s;
  }
  if (!std::isfinite(least)) return place;
  place.any = true;
  place.on_border = border.has(best, mesh_->triangles[best], shares);
  place.normal_W = normal_at(best, shares);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t vertex = mesh_->triangles[best][k];
    const double share = shares[static_cast<Eigen::Index>(k)];
    const auto c = mesh_->coefficients_W_mm.middleRows<3>(static_cast<Eigen::Index>(3 * vertex));
    place.point_W_mm += share * position(vertex);
    place.velocity_W_mm_per_s += share * (c * rate_);
    // What the corners' errors have in common makes the place's no larger than their mean.
    place.variance_mm2 += share * variance_along(vertex, place.normal_W);
  }
  const bool in_front = (p_W_mm - place.point_W_mm).dot(place.normal_W) >= 0.0;
  place.distance_mm = in_front ? std::sqrt(least) : -std::sqrt(least);
  return place;
}

}  // namespace perimap

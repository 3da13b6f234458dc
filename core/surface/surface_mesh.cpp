#include "core/surface/surface_mesh.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/surface/six_elements.hpp"

namespace perimap {
namespace {

// Of the angle between a triangle's normal and the ray: 80 degrees.
constexpr double kEdgeOnCosine = 0.17;

struct Lattice {
  Vector2d origin;
  double step_mm = 1.0;
  std::size_t columns = 0;
  std::size_t rows = 0;

  [[nodiscard]] Vector2d at(std::size_t row, std::size_t column) const {
    const double shift = row % 2 == 0 ? 0.0 : 0.5;
    return origin +
           step_mm * Vector2d(static_cast<double>(column) + shift, static_cast<double>(row) * std::sqrt(3.0) / 2.0);
  }
  [[nodiscard]] std::size_t index(std::size_t row, std::size_t column) const { return row * columns + column; }
};

// About so many places over what is around the features.
Lattice lattice_over(const EvidenceSupport& support, std::size_t vertices) {
  Vector2d low = Vector2d::Constant(std::numeric_limits<double>::infinity());
  Vector2d high = -low;
  for (const Vector2d& s : support.places()) {
    low = low.cwiseMin(s);
    high = high.cwiseMax(s);
  }
  const Vector2d margin = Vector2d::Constant(support.margin_mm());
  low -= margin;
  high += margin;
  const Vector2d size = high - low;
  Lattice lattice;
  lattice.origin = low;
  lattice.step_mm = std::sqrt(size.prod() / static_cast<double>(vertices) * 2.0 / std::sqrt(3.0));
  lattice.columns = static_cast<std::size_t>(size.x() / lattice.step_mm) + 1;
  lattice.rows = static_cast<std::size_t>(size.y() / (lattice.step_mm * std::sqrt(3.0) / 2.0)) + 1;
  return lattice;
}

using Triangle = std::array<std::size_t, 3>;

std::vector<Triangle> triangles_of(const Lattice& lattice) {
  std::vector<Triangle> triangles;
  for (std::size_t row = 0; row + 1 < lattice.rows; ++row) {
    for (std::size_t column = 0; column + 1 < lattice.columns; ++column) {
      const std::size_t a = lattice.index(row, column);
      const std::size_t b = lattice.index(row, column + 1);
      const std::size_t c = lattice.index(row + 1, column);
      const std::size_t d = lattice.index(row + 1, column + 1);
      if (row % 2 == 0) {
        triangles.push_back({a, b, c});
        triangles.push_back({b, d, c});
      } else {
        triangles.push_back({a, b, d});
        triangles.push_back({a, d, c});
      }
    }
  }
  return triangles;
}

}  // namespace

SurfaceMesh mesh_of(const PeriodicSurface& surface, std::size_t vertices) {
  const Lattice lattice = lattice_over(surface.support(), std::max<std::size_t>(vertices, 4));
  std::vector<Vector2d> places;
  std::vector<std::size_t> lattice_index;
  // Most of what is far from features is told without predicting it.
  for (std::size_t row = 0; row < lattice.rows; ++row) {
    for (std::size_t column = 0; column < lattice.columns; ++column) {
      if (surface.support().at(lattice.at(row, column)) != Support::kSupported) continue;
      places.push_back(lattice.at(row, column));
      lattice_index.push_back(lattice.index(row, column));
    }
  }
  const PredictedPlaces predicted = surface.predict(places);

  SurfaceMesh mesh;
  mesh.layout = surface.layout();
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> vertex_of(lattice.rows * lattice.columns, kNone);
  std::vector<Eigen::Index> kept;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (predicted.support[i] == Support::kSupported) {
      vertex_of[lattice_index[i]] = static_cast<std::uint32_t>(kept.size());
    } else if (predicted.support[i] != Support::kUncertain) {
      continue;
    }
    kept.push_back(static_cast<Eigen::Index>(i));
    mesh.support.push_back(predicted.support[i]);
  }
  const auto V = static_cast<Eigen::Index>(kept.size());
  mesh.coefficients_W_mm.resize(3 * V, surface.layout().size());
  mesh.covariances_W_mm2.resize(6, V);
  for (Eigen::Index v = 0; v < V; ++v) {
    const Eigen::Index from = kept[static_cast<std::size_t>(v)];
    mesh.coefficients_W_mm.middleRows<3>(3 * v) = predicted.coefficients_W_mm.middleRows<3>(3 * from);
    mesh.covariances_W_mm2.col(v) = predicted.covariances_W_mm2.col(from);
  }
  const auto mean_place = [&](std::uint32_t v) { return Vector3d(mesh.coefficients_W_mm.block<3, 1>(3 * v, 0)); };
  for (const Triangle& triangle : triangles_of(lattice)) {
    const std::array<std::uint32_t, 3> corners = {vertex_of[triangle[0]], vertex_of[triangle[1]],
                                                  vertex_of[triangle[2]]};
    if (std::find(corners.begin(), corners.end(), kNone) != corners.end()) continue;
    const Vector3d p = mean_place(corners[0]);
    const Vector3d normal = (mean_place(corners[1]) - p).cross(mean_place(corners[2]) - p);
    const Vector3d ray = p - surface.chart().X_WA.t;
    const double cosine = normal.dot(ray) / (normal.norm() * ray.norm());
    if (!(std::abs(cosine) > kEdgeOnCosine)) continue;
    // The lattice turns from x to y, which is clockwise for who looks along z; the surface's front turns the other way.
    mesh.triangles.push_back({corners[0], corners[2], corners[1]});
  }
  return mesh;
}

EvaluatedSurface::EvaluatedSurface(const SurfaceMesh& mesh)
    : largest_mm2_(mesh.vertices()),
      positions_(3 * mesh.vertices()),
      rates_(3 * mesh.vertices()),
      deviations_(mesh.vertices()) {
  Eigen::SelfAdjointEigenSolver<Matrix3d> solver;
  for (Eigen::Index v = 0; v < mesh.vertices(); ++v) {
    solver.computeDirect(from_six(mesh.covariances_W_mm2.col(v)), Eigen::EigenvaluesOnly);
    largest_mm2_(v) = solver.eigenvalues()(2);
  }
}

void EvaluatedSurface::evaluate(const SurfaceMesh& mesh, const Basis& b, const Basis& rate,
                                double phase_deviation_rad) noexcept {
  // Block by block, so that both sums stay in the first cache while each coefficient is read once.
  constexpr Eigen::Index kRows = 96;
  const Eigen::Index rows = positions_.size();
  for (Eigen::Index first = 0; first < rows; first += kRows) {
    const Eigen::Index count = std::min(kRows, rows - first);
    auto p = positions_.segment(first, count);
    auto v = rates_.segment(first, count);
    p.setZero();
    v.setZero();
    for (Eigen::Index j = 0; j < b.size(); ++j) {
      const auto c = mesh.coefficients_W_mm.col(j).segment(first, count);
      p += b(j) * c;
      v += rate(j) * c;
    }
  }
  const double variance_rad2 = phase_deviation_rad * phase_deviation_rad;
  // The largest eigenvalue of a sum is not above the sum of the largest ones (Weyl).
  deviations_ =
      (largest_mm2_.array() + variance_rad2 * this->rates().colwise().squaredNorm().transpose().array()).sqrt();
}

}  // namespace perimap

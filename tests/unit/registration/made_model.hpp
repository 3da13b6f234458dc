// An egg of three different axes, closed, and what a camera above it sees of it.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <random>

#include "core/registration/model_fit.hpp"

namespace perimap::test {

// Rings about the z axis; `cut`: rings left out at the top, so that it is open there. `bump` makes it no ellipsoid, so
// that each place is one.
inline TriangleMesh made_egg(int rings = 40, int spokes = 60, int cut = 0, const Vector3d& axes = {36.0, 44.0, 55.0},
                             double bump = 0.12) {
  TriangleMesh mesh;
  const auto place = [&](double latitude, double longitude) {
    const Vector3d u(std::sin(latitude) * std::cos(longitude), std::sin(latitude) * std::sin(longitude),
                     std::cos(latitude));
    const double r = 1.0 + bump * std::sin(3.0 * u.x() + 1.0) * std::cos(4.0 * u.y()) + 0.5 * bump * u.z() * u.x();
    return Vector3d(r * axes.cwiseProduct(u));
  };
  const int first = 1 + cut;
  for (int ring = first; ring < rings; ++ring) {
    for (int spoke = 0; spoke < spokes; ++spoke) {
      mesh.vertices.push_back(place(std::numbers::pi * ring / rings, 2.0 * std::numbers::pi * spoke / spokes));
    }
  }
  const auto at = [&](int ring, int spoke) {
    return static_cast<std::uint32_t>((ring - first) * spokes + spoke % spokes);
  };
  for (int ring = first; ring + 1 < rings; ++ring) {
    for (int spoke = 0; spoke < spokes; ++spoke) {
      mesh.triangles.push_back({at(ring, spoke), at(ring + 1, spoke), at(ring + 1, spoke + 1)});
      mesh.triangles.push_back({at(ring, spoke), at(ring + 1, spoke + 1), at(ring, spoke + 1)});
    }
  }
  const auto pole = [&](double latitude, int ring, bool top) {
    const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back(place(latitude, 0.0));
    for (int spoke = 0; spoke < spokes; ++spoke) {
      const std::uint32_t a = at(ring, spoke), b = at(ring, spoke + 1);
      mesh.triangles.push_back(top ? TriangleMesh::Triangle{middle, a, b} : TriangleMesh::Triangle{middle, b, a});
    }
  };
  if (cut == 0) pole(0.0, 1, true);
  pole(std::numbers::pi, rings - 1, false);
  return mesh;
}

// The model's vertices that face a direction, as a surface that was measured, with a deviation and white errors.
inline SurfacePoints seen_of(const TriangleMesh& model, const Pose& X_WI, const Vector3d& from_I, double deviation_mm,
                             std::mt19937_64& random) {
  std::vector<Vector3d> normals(model.vertices.size(), Vector3d::Zero());
  for (const auto& [a, b, c] : model.triangles) {
    const Vector3d n = (model.vertices[b] - model.vertices[a]).cross(model.vertices[c] - model.vertices[a]);
    for (const std::uint32_t v : {a, b, c}) normals[v] += n;
  }
  std::vector<std::size_t> kept;
  for (std::size_t v = 0; v < normals.size(); ++v) {
    if (normals[v].normalized().dot(from_I) > 0.45) kept.push_back(v);
  }
  const auto N = static_cast<Eigen::Index>(kept.size());
  SurfacePoints points{Eigen::Matrix3Xd(3, N), Eigen::Matrix3Xd(3, N), Eigen::Matrix3Xd::Zero(3, N),
                       Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, N)};
  std::normal_distribution<double> normal(0.0, deviation_mm);
  for (Eigen::Index i = 0; i < N; ++i) {
    const std::size_t v = kept[static_cast<std::size_t>(i)];
    const Vector3d error(normal(random), normal(random), normal(random));
    points.positions_W_mm.col(i) = X_WI * model.vertices[v] + error;
    points.normals_W.col(i) = X_WI.R * normals[v].normalized();
    for (const Eigen::Index diagonal : {0, 3, 5}) points.covariances_W_mm2(diagonal, i) = deviation_mm * deviation_mm;
  }
  return points;
}

}  // namespace perimap::test

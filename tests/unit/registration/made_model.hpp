// What a camera sees of a model.
#pragma once

#include <Eigen/Dense>
#include <random>

#include "core/registration/model_fit.hpp"
#include "made_egg.hpp"

namespace perimap::test {

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

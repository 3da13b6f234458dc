#include "core/registration/residual_covariance.hpp"

#include <cmath>

namespace perimap {
namespace {

// What no model explains: triangles for a curve, coordinates that were rounded.
constexpr double kLeast_mm = 0.05;

double matern32(double distance_mm, double length_mm) {
  const double u = std::sqrt(3.0) * distance_mm / length_mm;
  return (1.0 + u) * std::exp(-u);
}

}  // namespace

Eigen::MatrixXd residual_covariance(const MetPoints& points, const ModelErrors& errors) {
  const Eigen::Index N = points.size();
  const double shape_mm2 = errors.shape_mm * errors.shape_mm;
  const double phase_rad2 = errors.phase_rad * errors.phase_rad;
  Eigen::MatrixXd C(N, N);
  for (Eigen::Index j = 0; j < N; ++j) {
    for (Eigen::Index i = 0; i <= j; ++i) {
      const double apart_mm = (points.places_I_mm.col(i) - points.places_I_mm.col(j)).norm();
      const double shared =
          errors.common_share + (1.0 - errors.common_share) * matern32(apart_mm, errors.surface_length_mm);
      C(i, j) = C(j, i) = shared * points.spreads.col(i).dot(points.spreads.col(j)) +
                          shape_mm2 * matern32(apart_mm, errors.shape_length_mm) +
                          phase_rad2 * points.rates_mm_per_rad(i) * points.rates_mm_per_rad(j);
    }
  }
  C.diagonal().array() += kLeast_mm * kLeast_mm;
  return C;
}

}  // namespace perimap

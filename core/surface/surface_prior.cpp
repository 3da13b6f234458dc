#include "core/surface/surface_prior.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace perimap {
namespace {

// Along the surface: further than a first match can be off by what the organ moves.
constexpr double kAlong_mm = 5.0;
// The surface's variances are taken for so much larger, and for no smaller than this.
constexpr double kDoubt = 1.0;
constexpr double kLeast_mm2 = 1e-4;

// The lower triangular factor in W of a covariance in A.
Matrix3d factor_of(const SurfaceChart& chart, const Matrix3d& covariance_A_mm2) {
  const Matrix3d& R_WA = chart.X_WA.R;
  const Matrix3d P = R_WA * covariance_A_mm2 * R_WA.transpose() + kLeast_mm2 * Matrix3d::Identity();
  return P.llt().matrixL();
}

// The covariance of the mean place. G . (p - p0) is by how much a place near p0 is deeper than the surface.
Matrix3d of_mean(const PeriodicSurface& surface, const Vector2d& s) {
  const DepthField::Prediction depth = surface.depth().at(s);
  const double z = depth.depth_mm(0);
  const double variance_mm2 = kDoubt * (depth.variance_mm2(0) + surface.turning_variance_mm2(s, z)) + kLeast_mm2;
  const Vector2d slope = surface.depth().slope_at(s);
  const Vector2d across = -(surface.chart().depth_mm / z) * slope;
  const Vector3d G(across.x(), across.y(), 1.0 + slope.dot(s) / z);
  const Matrix3d information = G * G.transpose() / variance_mm2 + Matrix3d::Identity() / (kAlong_mm * kAlong_mm);
  return information.inverse();
}

// The covariance of either coefficient of a band, by the weights of its group at one place (docs/design/surface.md).
Matrix3d of_band(const PeriodicSurface& surface, const MotionField& field, const MotionField::Weights& weights,
                 const ChartedHarmonics& by_gains, int band, Eigen::Index of_group) {
  const Matrix3d R_AW = surface.chart().X_WA.R.transpose();
  const double across = field.noise_scale_across();
  const double along = field.noise_scale_along();
  Matrix3d own = Matrix3d::Zero();
  Matrix3d mean = Matrix3d::Zero();
  double sum = 0.0;
  for (std::size_t i = 0; i < surface.evidence().size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const Matrix3d N = R_AW * surface.evidence()[i].bands_mm2[static_cast<std::size_t>(band)] * R_AW.transpose();
    const double w = weights.across(row, 0);
    const Vector3d D(std::sqrt(across) * w, std::sqrt(across) * w, std::sqrt(along) * weights.along(row, 0));
    own += D.asDiagonal() * N * D.asDiagonal();
    mean += std::abs(w) * N;
    sum += std::abs(w);
  }
  const double common_across = std::sqrt(std::max(0.0, 1.0 - across));
  const Vector3d C(common_across, common_across, std::sqrt(std::max(0.0, 1.0 - along)));
  const Matrix3d common = C.asDiagonal() * mean * C.asDiagonal() / std::max(sum, 1e-12);
  const double left_across = field.variances_across()(of_group) * weights.unexplained_across(0);
  const double left_along = field.variances_along()(of_group) * weights.unexplained_along(0);
  Matrix3d covariance = Matrix3d(Vector3d(left_across, left_across, left_along).asDiagonal()) + own + common;
  if (!field.gains().empty()) {
    covariance += gain_covariance_mm2(by_gains, field.gains()[static_cast<std::size_t>(of_group)], 0, of_group);
  }
  return kDoubt * covariance;
}

}  // namespace

std::optional<FeaturePrior> prior_at(const PeriodicSurface& surface, const Vector2d& s) {
  const BasisLayout& layout = surface.layout();
  const int n = layout.size();
  const std::array<Vector2d, 1> places = {s};
  const PredictedPlaces there = surface.predict(places);
  if (there.support.front() != Support::kSupported) return std::nullopt;
  FeaturePrior prior;
  prior.x.resize(3 * n);
  for (int axis = 0; axis < 3; ++axis) {
    prior.x.segment(axis * n, n) = there.coefficients_W_mm.row(axis).transpose();
  }
  const Vector3d mean_W = there.coefficients_W_mm.col(0);
  prior.factors_mm[0] = factor_of(surface.chart(), of_mean(surface, s));
  const Eigen::ArrayXXd r_mm = distances(surface.mean_places(), mean_W);
  const OwnHarmonics own_W_mm = surface.own_at(mean_W);
  for (const HarmonicGroup group : kEveryHarmonicGroup) {
    const auto& field = surface.motion()[static_cast<std::size_t>(group)];
    if (!field) continue;
    const MotionField::Weights weights = field->weights(r_mm);
    const ChartedHarmonics by_gains =
        field->gains().empty() ? ChartedHarmonics() : field->by_gains(weights, surface.charted_model(own_W_mm, group));
    const auto [first, end] = bands_of(layout, group);
    for (int band = first; band < end; ++band) {
      const BandPlace place = band_place(layout, band);
      const Matrix3d L = factor_of(surface.chart(), of_band(surface, *field, weights, by_gains, band, band - first));
      prior.factors_mm[static_cast<std::size_t>(place.cosine)] = L;
      prior.factors_mm[static_cast<std::size_t>(place.sine)] = L;
    }
  }
  return prior;
}

}  // namespace perimap

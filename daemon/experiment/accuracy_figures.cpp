#include "daemon/experiment/accuracy_figures.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "daemon/experiment/method.hpp"

namespace perimap {
namespace {

constexpr int kPhases = 24;

double phase_of(int i) { return 2.0 * std::numbers::pi * i / kPhases; }

}  // namespace

double path_error_mm(const FeatureEstimate& estimate, const BasisLayout& layout, const Scene& scene,
                     const SceneFeature& feature) {
  double sum = 0.0;
  for (int i = 0; i < kPhases; ++i) {
    sum += (estimate.position(basis_at(layout, phase_of(i))) - scene.true_position(feature, phase_of(i))).squaredNorm();
  }
  return std::sqrt(sum / kPhases);
}

double normalised_squared_error(const FeatureEstimate& estimate, const BasisLayout& layout, const Scene& scene,
                                const SceneFeature& feature) {
  double sum = 0.0;
  for (int i = 0; i < kPhases; ++i) {
    const Basis b = basis_at(layout, phase_of(i));
    const Vector3d error = estimate.position(b) - scene.true_position(feature, phase_of(i));
    sum += error.dot(estimate.position_covariance(b).llt().solve(error));
  }
  return sum / (3.0 * kPhases);
}

double path_deviation_mm(const FeatureEstimate& estimate, const BasisLayout& layout) {
  double sum = 0.0;
  for (int i = 0; i < kPhases; ++i) sum += estimate.position_covariance(basis_at(layout, phase_of(i))).trace();
  return std::sqrt(sum / kPhases);
}

std::vector<double> drawn_path_errors_mm(const FeatureEstimate& estimate, const BasisLayout& layout, int draws,
                                         std::uint64_t seed) {
  const Eigen::MatrixXd L = Eigen::MatrixXd(estimate.P).llt().matrixL();
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::vector<double> errors;
  for (int draw = 0; draw < draws; ++draw) {
    Eigen::VectorXd unit(L.rows());
    for (double& value : unit) value = normal(generator);
    const StateVector error = L * unit;
    double sum = 0.0;
    for (int i = 0; i < kPhases; ++i) sum += position_of(error, basis_at(layout, phase_of(i))).squaredNorm();
    errors.push_back(std::sqrt(sum / kPhases));
  }
  return errors;
}

FeatureEstimate cramer_rao_bound(const Scene& scene, const SceneFeature& feature, const BasisLayout& layout,
                                 const Prior& prior, int end_frame) {
  const Eigen::Index n = layout.size();
  const Eigen::Index n_true = scene.layout.size();
  const int H = layout.cardiac_harmonics;
  const int H_true = scene.layout.cardiac_harmonics;
  FeatureEstimate bound = prior_estimate(layout, prior, Vector3d::Zero());
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    bound.x(axis * n) = feature.x(axis * n_true);
    for (int k = 1; k <= H_true; ++k) {
      bound.x(axis * n + k) = feature.x(axis * n_true + k);
      bound.x(axis * n + H + k) = feature.x(axis * n_true + H_true + k);
    }
  }
  Eigen::MatrixXd information = Eigen::MatrixXd(bound.P.diagonal().cwiseInverse().asDiagonal());
  for (const Sighting& sighting : feature.sightings) {
    if (sighting.frame >= end_frame || sighting.outlier) continue;
    const SceneFrame& frame = scene.frames[static_cast<std::size_t>(sighting.frame)];
    const Vector3d p = scene.true_position(feature, frame.phase_rad);
    const Observation o = observation_of(scene, layout, sighting, p);
    Vector2d z;
    MeasurementJacobians J;
    if (std::visit([&](const auto& model) { return measure(model, frame.X_CW, p, z, &J); }, scene.model) !=
        ProjectionStatus::kOk)
      continue;
    // B^T G B = G (x) b b^T.
    const Matrix3d G = J.dz_dp.transpose() * o.R.inverse() * J.dz_dp;
    const Eigen::MatrixXd bb = o.b * o.b.transpose();
    for (Eigen::Index row = 0; row < 3; ++row) {
      for (Eigen::Index column = 0; column < 3; ++column)
        information.block(row * n, column * n, n, n) += G(row, column) * bb;
    }
  }
  const Eigen::MatrixXd P = information.llt().solve(Eigen::MatrixXd::Identity(3 * n, 3 * n));
  bound.P = 0.5 * (P + P.transpose());
  return bound;
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const double at = q * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  const double share = at - static_cast<double>(below);
  if (share == 0.0 || values[below] == values[above]) return values[below];
  return (1.0 - share) * values[below] + share * values[above];
}

}  // namespace perimap

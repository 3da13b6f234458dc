#include "daemon/evaluation/experiment/accuracy_figures.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include "daemon/evaluation/experiment/method.hpp"

namespace perimap {
namespace {

// So many equal steps make the mean of a square exact for any motion of the largest layout.
constexpr int kPhases = 2 * kMaxHarmonics + 1;
constexpr int kBreathPhases = 2 * kMaxRespiratoryHarmonics + 1;

struct CyclePhases {
  double cardiac_rad = 0.0;
  double breath_rad = 0.0;
};

// The mean of visit(phases) over the cardiac cycle, and over the respiratory one too when `breath`.
template <class Visit>
double mean_over_cycles(bool breath, Visit&& visit) {
  const auto step_rad = [](int i, int steps) { return 2.0 * std::numbers::pi * i / steps; };
  const int breath_phases = breath ? kBreathPhases : 1;
  double sum = 0.0;
  for (int j = 0; j < breath_phases; ++j) {
    for (int i = 0; i < kPhases; ++i) sum += visit({step_rad(i, kPhases), step_rad(j, breath_phases)});
  }
  return sum / (kPhases * breath_phases);
}

Basis basis_of(const BasisLayout& layout, const CyclePhases& at) {
  return basis_at(layout, at.cardiac_rad, at.breath_rad);
}

bool breathes(const BasisLayout& layout) { return layout.respiratory_harmonics > 0; }

// The coefficients in a layout that holds all of them.
StateVector widened(const StateVector& x, const BasisLayout& from, const BasisLayout& to) {
  if (to.cardiac_harmonics < from.cardiac_harmonics || to.respiratory_harmonics < from.respiratory_harmonics)
    throw std::invalid_argument("the layout lacks harmonics of the truth");
  const int H = from.cardiac_harmonics;
  const int H_r = from.respiratory_harmonics;
  StateVector wide = StateVector::Zero(to.state_size());
  for (int axis = 0; axis < 3; ++axis) {
    const auto source = x.segment(axis * from.size(), from.size());
    auto target = wide.segment(axis * to.size(), to.size());
    target(0) = source(0);
    for (const int part : {0, 1}) {
      target.segment(1 + part * to.cardiac_harmonics, H) = source.segment(1 + part * H, H);
      target.segment(1 + 2 * to.cardiac_harmonics + part * to.respiratory_harmonics, H_r) =
          source.segment(1 + 2 * H + part * H_r, H_r);
    }
  }
  return wide;
}

}  // namespace

double path_error_mm(const FeatureEstimate& estimate, const BasisLayout& layout, const Scene& scene,
                     const SceneFeature& feature) {
  return std::sqrt(mean_over_cycles(breathes(layout) || breathes(scene.layout), [&](const CyclePhases& at) {
    return (estimate.position(basis_of(layout, at)) - position_of(feature.x, basis_of(scene.layout, at))).squaredNorm();
  }));
}

double normalised_squared_error(const FeatureEstimate& estimate, const BasisLayout& layout, const Scene& scene,
                                const SceneFeature& feature) {
  return mean_over_cycles(breathes(layout) || breathes(scene.layout), [&](const CyclePhases& at) {
    const Basis b = basis_of(layout, at);
    const Vector3d error = estimate.position(b) - position_of(feature.x, basis_of(scene.layout, at));
    return error.dot(estimate.position_covariance(b).llt().solve(error)) / 3.0;
  });
}

double path_deviation_mm(const FeatureEstimate& estimate, const BasisLayout& layout) {
  return std::sqrt(mean_over_cycles(breathes(layout), [&](const CyclePhases& at) {
    return estimate.position_covariance(basis_of(layout, at)).trace();
  }));
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
    errors.push_back(std::sqrt(mean_over_cycles(breathes(layout), [&](const CyclePhases& at) {
      return position_of(error, basis_of(layout, at)).squaredNorm();
    })));
  }
  return errors;
}

FeatureEstimate cramer_rao_bound(const Scene& scene, const SceneFeature& feature, const BasisLayout& layout,
                                 const Prior& prior, int end_frame) {
  const Eigen::Index n = layout.size();
  FeatureEstimate bound = prior_estimate(layout, prior, Vector3d::Zero());
  bound.x = widened(feature.x, scene.layout, layout);
  Eigen::MatrixXd information = Eigen::MatrixXd(bound.P.diagonal().cwiseInverse().asDiagonal());
  for (const Sighting& sighting : feature.sightings) {
    if (sighting.frame >= end_frame || sighting.outlier) continue;
    const SceneFrame& frame = scene.frames[static_cast<std::size_t>(sighting.frame)];
    const Vector3d p = scene.true_position(feature, frame);
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

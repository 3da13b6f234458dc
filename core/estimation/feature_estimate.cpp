#include "core/estimation/feature_estimate.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace perimap {

PositionGain position_gain(const StateMatrix& P, const Basis& b) noexcept {
  const Eigen::Index n = b.size();
  PositionGain M(P.rows(), 3);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    M.col(axis).noalias() = P.middleCols(axis * n, n).lazyProduct(b);
  }
  return M;
}

Matrix3d position_covariance(const StateMatrix& P, const Basis& b) noexcept {
  const Eigen::Index n = b.size();
  Matrix3d S;
  for (int j = 0; j < 3; ++j) {
    for (int i = j; i < 3; ++i) {
      double sum = 0.0;
      for (Eigen::Index k = 0; k < n; ++k) sum += b(k) * P.col(j * n + k).segment(i * n, n).dot(b);
      S(i, j) = S(j, i) = sum;
    }
  }
  return S;
}

double largest_deviation_mm(const FeatureEstimate& estimate, const BasisLayout& layout, int phases,
                            bool breath) noexcept {
  const double step = 2.0 * std::numbers::pi / phases;
  // Four steps find the extremes of one harmonic, and lie within 8 % of those of two.
  const int breath_phases = breath && layout.respiratory_harmonics > 0 ? 4 * layout.respiratory_harmonics : 1;
  const double breath_step = 2.0 * std::numbers::pi / breath_phases;
  double largest = 0.0;
  for (int m = 0; m < breath_phases; ++m) {
    for (int n = 0; n < phases; ++n) {
      const Basis b = breath ? basis_at(layout, n * step, m * breath_step) : basis_without_breath(layout, n * step);
      const Matrix3d S = estimate.position_covariance(b);
      Eigen::SelfAdjointEigenSolver<Matrix3d> solver;
      solver.computeDirect(S, Eigen::EigenvaluesOnly);
      largest = std::max(largest, solver.eigenvalues()(2));
    }
  }
  return std::sqrt(largest);
}

Basis prior_deviations(const BasisLayout& layout, const Prior& prior) noexcept {
  Basis deviations(layout.size());
  deviations(0) = prior.dc_mm;
  const auto fill = [&](int begin, int harmonics, double first_mm) {
    for (int k = 1; k <= harmonics; ++k) {
      const double deviation = first_mm / std::pow(k, prior.decay);
      deviations(begin + k - 1) = deviation;
      deviations(begin + harmonics + k - 1) = deviation;
    }
  };
  fill(1, layout.cardiac_harmonics, prior.cardiac_mm);
  fill(1 + 2 * layout.cardiac_harmonics, layout.respiratory_harmonics, prior.respiratory_mm);
  return deviations;
}

Basis diffusion_shape(const BasisLayout& layout) noexcept {
  constexpr Prior kUnit{.dc_mm = 1.0, .cardiac_mm = 1.0, .respiratory_mm = 1.0, .decay = 1.0};
  return prior_deviations(layout, kUnit).cwiseAbs2();
}

void diffuse(FeatureEstimate& estimate, const BasisLayout& layout, double deviation_mm) noexcept {
  const Basis variances = deviation_mm * deviation_mm * diffusion_shape(layout);
  const Eigen::Index n = variances.size();
  for (Eigen::Index axis = 0; axis < 3; ++axis) estimate.P.diagonal().segment(axis * n, n) += variances;
}

FeatureEstimate prior_estimate(const BasisLayout& layout, const Prior& prior, const Vector3d& p_WF) noexcept {
  const int n = layout.size();
  const Basis deviations = prior_deviations(layout, prior);
  FeatureEstimate estimate;
  estimate.x.setZero(3 * n);
  estimate.P.setZero(3 * n, 3 * n);
  for (int axis = 0; axis < 3; ++axis) {
    estimate.x(axis * n) = p_WF(axis);
    estimate.P.diagonal().segment(axis * n, n) = deviations.array().square();
  }
  return estimate;
}

}  // namespace perimap

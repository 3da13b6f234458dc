#include "drivers/standins/trace/two_phase_map.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace perimap {
namespace {

constexpr double kLeastVariance_mm2 = 1e-4;

Eigen::Index functions(const TwoPhaseMapSettings& settings) noexcept {
  return 1 + 2 * (settings.cardiac_harmonics + settings.respiratory_harmonics) + 4 * settings.product_harmonics;
}

// The mean is free; smooth motion has little in its high harmonics, and breathing changes the beat but little.
Eigen::VectorXd ridge(const TwoPhaseMapSettings& settings) {
  Eigen::VectorXd diagonal(functions(settings));
  Eigen::Index row = 0;
  diagonal[row++] = 0.0;
  for (const int harmonics : {settings.cardiac_harmonics, settings.respiratory_harmonics}) {
    for (int k = 1; k <= harmonics; ++k, row += 2) diagonal.segment<2>(row).setConstant(settings.ridge * k * k);
  }
  diagonal.tail(diagonal.size() - row).setConstant(settings.product_ridge);
  return diagonal;
}

}  // namespace

TwoPhaseMap::TwoPhaseMap(const TwoPhaseMapSettings& settings, const Eigen::MatrixXd& samples, double period_s,
                         const PhaseTracks& phases)
    : settings_(settings) {
  const Eigen::Index count = samples.rows();
  Eigen::MatrixXd B(count, functions(settings));
  Eigen::VectorXd weight(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    B.row(i) = basis(phases.cardiac[i], phases.respiratory[i]).col(0).transpose();
    weight[i] = std::exp(-static_cast<double>(count - 1 - i) * period_s / settings.memory_s);
  }
  Eigen::MatrixXd normal = B.transpose() * weight.asDiagonal() * B;
  normal.diagonal() += ridge(settings);
  coefficients_ = normal.ldlt().solve(B.transpose() * weight.asDiagonal() * samples);
  const Eigen::MatrixXd residual = samples - B * coefficients_;
  variance_ = (weight.transpose() * residual.cwiseAbs2() / weight.sum()).cwiseMax(kLeastVariance_mm2);
}

Eigen::MatrixX3d TwoPhaseMap::basis(double cardiac, double respiratory) const {
  Eigen::MatrixX3d b(functions(settings_), 3);
  Eigen::Index row = 0;
  const auto put = [&](double value, double by_cardiac, double by_respiratory) {
    b.row(row++) << value, by_cardiac, by_respiratory;
  };
  put(1.0, 0.0, 0.0);
  for (int k = 1; k <= settings_.cardiac_harmonics; ++k) {
    put(std::cos(k * cardiac), -k * std::sin(k * cardiac), 0.0);
    put(std::sin(k * cardiac), k * std::cos(k * cardiac), 0.0);
  }
  for (int k = 1; k <= settings_.respiratory_harmonics; ++k) {
    put(std::cos(k * respiratory), 0.0, -k * std::sin(k * respiratory));
    put(std::sin(k * respiratory), 0.0, k * std::cos(k * respiratory));
  }
  const double C = std::cos(respiratory);
  const double S = std::sin(respiratory);
  for (int k = 1; k <= settings_.product_harmonics; ++k) {
    const double c = std::cos(k * cardiac);
    const double s = std::sin(k * cardiac);
    put(c * C, -k * s * C, -c * S);
    put(c * S, -k * s * S, c * C);
    put(s * C, k * c * C, -s * S);
    put(s * S, k * c * S, s * C);
  }
  return b;
}

Eigen::RowVectorXd TwoPhaseMap::at(double cardiac, double respiratory) const {
  return basis(cardiac, respiratory).col(0).transpose() * coefficients_;
}

TwoPhaseMap::Slopes TwoPhaseMap::slopes(double cardiac, double respiratory) const {
  const Eigen::MatrixX3d b = basis(cardiac, respiratory);
  return {b.col(0).transpose() * coefficients_, b.col(1).transpose() * coefficients_,
          b.col(2).transpose() * coefficients_};
}

}  // namespace perimap

#include "core/estimation/feature_estimate.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace perimap {
namespace {

TEST(FeatureEstimate, PositionCovarianceIsThatOfTheBasisMatrix) {
  std::mt19937 generator(1);
  std::normal_distribution<double> normal;
  const BasisLayout layout{4, 1};
  const int n = layout.size();
  Eigen::MatrixXd A(3 * n, 3 * n);
  for (double& value : A.reshaped()) value = normal(generator);
  const FeatureEstimate estimate{StateVector::Zero(3 * n), StateMatrix(A * A.transpose())};
  const Basis b = basis_at(layout, 0.7, 1.9);
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(3, 3 * n);
  for (int axis = 0; axis < 3; ++axis) B.block(axis, axis * n, 1, n) = b.transpose();
  const Eigen::MatrixXd expected = B * estimate.P * B.transpose();
  EXPECT_LT((estimate.position_covariance(b) - expected).norm(), 1e-12 * expected.norm());
}

TEST(FeatureEstimate, LargestDeviationFindsTheWorstDirectionAndPhase) {
  const BasisLayout layout{1, 0};
  FeatureEstimate estimate{StateVector::Zero(9), StateMatrix::Zero(9, 9)};
  // Uncertain along (1, 1, 0): 2 mm constant; and in z by a_1 with 3 mm, worst at phase 0 and pi.
  for (const int i : {0, 3}) {
    for (const int j : {0, 3}) estimate.P(i, j) = 2.0;
  }
  EXPECT_NEAR(largest_deviation_mm(estimate, layout), 2.0, 1e-9);
  estimate.P(7, 7) = 9.0;
  EXPECT_NEAR(largest_deviation_mm(estimate, layout), 3.0, 1e-9);
}

TEST(FeatureEstimate, LargestDeviationAlsoSearchesTheRespiratoryCycle) {
  const BasisLayout layout{0, 1};
  FeatureEstimate estimate{StateVector::Zero(9), StateMatrix::Zero(9, 9)};
  estimate.P(2, 2) = 16.0;  // the respiratory sine of x: nothing at phase 0
  EXPECT_NEAR(largest_deviation_mm(estimate, layout), 4.0, 1e-9);
}

TEST(Prior, DeviationsFallWithTheHarmonicOnAllAxes) {
  const BasisLayout layout{3, 2};
  const FeatureEstimate estimate = prior_estimate(layout, Prior{}, Vector3d(1, 2, 3));
  const int n = layout.size();
  for (int axis = 0; axis < 3; ++axis) {
    const auto deviation = [&](int i) { return std::sqrt(estimate.P(axis * n + i, axis * n + i)); };
    EXPECT_DOUBLE_EQ(deviation(0), 40.0);
    EXPECT_DOUBLE_EQ(deviation(1), 4.0);
    EXPECT_DOUBLE_EQ(deviation(3), 4.0 / 9.0);
    EXPECT_DOUBLE_EQ(deviation(6), 4.0 / 9.0) << "sine of the third harmonic";
    EXPECT_DOUBLE_EQ(deviation(7), 8.0) << "respiration";
    EXPECT_DOUBLE_EQ(deviation(10), 2.0);
  }
  EXPECT_EQ(estimate.position(basis_at(layout, 0.4, 0.9)), Vector3d(1, 2, 3));
  EXPECT_EQ(estimate.P, StateMatrix(estimate.P.diagonal().asDiagonal()));
}

}  // namespace
}  // namespace perimap

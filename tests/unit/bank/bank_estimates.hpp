// Estimates, a lens and comparisons that tests of the bank share.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "core/estimation/feature_estimate.hpp"
#include "core/estimation/measurement_model.hpp"
#include "core/estimation/observation.hpp"

namespace perimap::test {

inline const PixelModel kDistorted{CameraModel{.width = 640,
                                               .height = 480,
                                               .fx = 520.0,
                                               .fy = 525.0,
                                               .cx = 310.0,
                                               .cy = 250.0,
                                               .k1 = -0.3,
                                               .k2 = 0.1,
                                               .p1 = 1e-3,
                                               .p2 = -2e-3,
                                               .k3 = 0.01}};

// Well conditioned, with correlations.
inline FeatureEstimate correlated(const Vector3d& p_WF, const BasisLayout& layout, double deviation,
                                  std::mt19937& generator) {
  std::normal_distribution<double> normal;
  const int d = layout.state_size();
  Eigen::MatrixXd A(d, d);
  for (double& value : A.reshaped()) value = 0.1 * normal(generator);
  const Eigen::MatrixXd P = deviation * deviation * (A * A.transpose() + Eigen::MatrixXd::Identity(d, d));
  FeatureEstimate estimate{StateVector::Zero(d), StateMatrix(P.selfadjointView<Eigen::Lower>())};
  for (double& value : estimate.x) value = 0.2 * deviation * normal(generator);
  for (int axis = 0; axis < 3; ++axis) estimate.x(axis * layout.size()) += p_WF(axis);
  return estimate;
}

inline double largest_difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

inline void expect_close(const FeatureEstimate& got, const FeatureEstimate& expected, double tolerance) {
  EXPECT_LT(largest_difference(got.x, expected.x), tolerance * expected.x.cwiseAbs().maxCoeff());
  EXPECT_LT(largest_difference(got.P, expected.P), tolerance * expected.P.cwiseAbs().maxCoeff());
}

inline void expect_identical(const FeatureEstimate& got, const FeatureEstimate& expected) {
  EXPECT_EQ(got.x, expected.x);
  EXPECT_EQ(got.P, expected.P);
}

}  // namespace perimap::test

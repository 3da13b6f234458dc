#include "core/estimation/iterated_update.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <random>

#include "core/estimation/batch_start.hpp"
#include "simulated_feature.hpp"

namespace perimap {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::kBearingDeviation;
using test::kPixelDeviation;
using test::kPixelModel;

// The paper's own formula, in the state's full dimension and with inverses: damped Gauss-Newton on J(x).
template <class Model>
FeatureEstimate dense_update(const FeatureEstimate& prior, const Observation& o, const Model& model, int iterations,
                             double gamma) {
  const MatrixXd P_inverse = MatrixXd(prior.P).llt().solve(MatrixXd::Identity(prior.P.rows(), prior.P.cols()));
  const MatrixXd R_inverse = o.R.inverse();
  const auto n = o.b.size();
  MatrixXd B = MatrixXd::Zero(3, 3 * n);
  for (int axis = 0; axis < 3; ++axis) B.block(axis, axis * n, 1, n) = o.b.transpose();
  VectorXd x = prior.x;
  Vector2d z;
  MatrixXd H;
  const auto linearise = [&] {
    MeasurementJacobians J;
    EXPECT_EQ(measure(model, o.X_CW, B * x, z, &J), ProjectionStatus::kOk);
    H = J.dz_dp * B;
  };
  for (int i = 0; i < iterations; ++i) {
    linearise();
    const MatrixXd A = P_inverse + H.transpose() * R_inverse * H;
    x += gamma * A.llt().solve(H.transpose() * R_inverse * model.residual(o.z, z) - P_inverse * (x - prior.x));
  }
  linearise();
  const MatrixXd A = P_inverse + H.transpose() * R_inverse * H;
  return {x, A.llt().solve(MatrixXd::Identity(A.rows(), A.cols()))};
}

// A well-conditioned prior with correlations, so that the inverses in the dense formula cost no accuracy.
FeatureEstimate correlated_prior(const StateVector& x_true, std::mt19937& generator) {
  std::normal_distribution<double> normal;
  const auto d = x_true.size();
  MatrixXd A(d, d);
  for (double& value : A.reshaped()) value = 0.1 * normal(generator);
  const MatrixXd symmetric = A * A.transpose() + MatrixXd::Identity(d, d);
  FeatureEstimate estimate{x_true, StateMatrix(symmetric.selfadjointView<Eigen::Lower>())};
  for (double& value : estimate.x) value += 0.3 * normal(generator);
  return estimate;
}

template <class Model>
void expect_dense_formula(const Model& model, double deviation) {
  std::mt19937 generator(11);
  for (const BasisLayout layout : {BasisLayout{0, 0}, BasisLayout{3, 0}, BasisLayout{8, 0}, BasisLayout{12, 2}}) {
    for (const auto& [iterations, gamma] : {std::pair(1, 1.0), std::pair(3, 1.0), std::pair(4, 0.5)}) {
      const test::SimulatedFeature feature =
          test::simulate_feature(model, layout, Prior{}, 1, deviation, 0.0, generator);
      const FeatureEstimate prior = correlated_prior(feature.x_true, generator);
      Observation observation = feature.observations[0];
      observation.R << 30.0, 5.0, 5.0, 20.0;
      observation.R *= deviation * deviation;
      const FeatureEstimate expected = dense_update(prior, observation, model, iterations, gamma);
      UpdateSettings settings;
      settings.method = UpdateMethod::kGaussNewton;
      settings.max_iterations = iterations;
      settings.step_factor = gamma;
      settings.tolerance = 0.0;
      settings.gate = 1e9;
      FeatureEstimate got = prior;
      ASSERT_TRUE(iterated_update(got, observation, model, settings).accepted);
      EXPECT_LT((got.x - expected.x).cwiseAbs().maxCoeff(), 1e-12 * expected.x.cwiseAbs().maxCoeff());
      EXPECT_LT((got.P - expected.P).cwiseAbs().maxCoeff(), 1e-12 * expected.P.cwiseAbs().maxCoeff());
    }
  }
}

TEST(IteratedUpdate, EqualsThePapersDenseFormulaForPixels) { expect_dense_formula(kPixelModel, kPixelDeviation); }
TEST(IteratedUpdate, EqualsThePapersDenseFormulaForBearings) {
  expect_dense_formula(BearingModel{}, kBearingDeviation);
}

struct Scene {
  BasisLayout layout{.cardiac_harmonics = 5};
  std::mt19937 generator{21};
  test::SimulatedFeature feature =
      test::simulate_feature(kPixelModel, layout, Prior{}, 300, kPixelDeviation, 0.0, generator);
  FeatureEstimate near_truth() const {
    FeatureEstimate estimate{feature.x_true, StateMatrix()};
    estimate.P = StateMatrix::Identity(layout.state_size(), layout.state_size());
    return estimate;
  }
};

TEST(IteratedUpdate, KeepsTheCovarianceSymmetricAndPositiveOverTenThousandUpdates) {
  Scene scene;
  std::normal_distribution<double> normal;
  const BatchOutcome start =
      batch_start(std::span(scene.feature.observations).first(60), kPixelModel, scene.layout, Prior{});
  ASSERT_TRUE(start.ok());
  FeatureEstimate estimate = start.estimate;
  int accepted = 0;
  for (int k = 0; k < 10000; ++k) {
    Observation observation = scene.feature.observations[static_cast<std::size_t>(k) % 300];
    observation.z += 0.3 * Vector2d(normal(scene.generator), normal(scene.generator));
    accepted += iterated_update(estimate, observation, kPixelModel).accepted ? 1 : 0;
    ASSERT_EQ(estimate.P, estimate.P.transpose()) << "update " << k;
    if (k % 1000 == 999) {
      const MatrixXd P = estimate.P;
      // Scaled to a unit diagonal, so that small coefficients count as much as large ones.
      const VectorXd scale = P.diagonal().cwiseSqrt().cwiseInverse();
      const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(MatrixXd(scale.asDiagonal() * P * scale.asDiagonal()));
      EXPECT_GT(solver.eigenvalues()(0), 1e-9) << "update " << k;
    }
  }
  EXPECT_GT(accepted, 9900);
  EXPECT_LT(largest_deviation_mm(estimate, scene.layout), 0.1);
}

TEST(IteratedUpdate, NeverRaisesTheCostAboveThePrediction) {
  Scene scene;
  const FeatureEstimate prior = prior_estimate(scene.layout, Prior{}, Vector3d(0, 0, -60));
  for (const Observation& observation : scene.feature.observations) {
    FeatureEstimate estimate = prior;
    UpdateSettings settings;
    settings.gate = 1e12;
    const UpdateOutcome outcome = iterated_update(estimate, observation, kPixelModel, settings);
    ASSERT_TRUE(outcome.accepted);
    const double predicted = outcome.innovation.squaredNorm() / (kPixelDeviation * kPixelDeviation);
    EXPECT_LE(outcome.map_cost, predicted * (1.0 + 1e-8));
    EXPECT_LE(outcome.iterations, settings.max_iterations);
  }
}

TEST(IteratedUpdate, CostAtTheOptimumEqualsTheNisWhereTheModelIsNearlyLinear) {
  Scene scene;
  FeatureEstimate estimate = scene.near_truth();
  estimate.P *= 1e-4;
  estimate.x(0) += 0.02;
  const UpdateOutcome outcome = iterated_update(estimate, scene.feature.observations[0], kPixelModel);
  ASSERT_TRUE(outcome.accepted);
  EXPECT_GT(outcome.map_cost, 0.0);
  EXPECT_NEAR(outcome.map_cost, outcome.normalised_innovation_squared, 1e-3 * outcome.map_cost);
}

// Everything that must leave the estimate as it was.
void expect_refused(const FeatureEstimate& before, const Observation& observation, UpdateStatus status,
                    const UpdateSettings& settings = {}) {
  for (const UpdateMethod method : {UpdateMethod::kLevenbergMarquardt, UpdateMethod::kGaussNewton}) {
    UpdateSettings with_method = settings;
    with_method.method = method;
    FeatureEstimate estimate = before;
    const UpdateOutcome outcome = iterated_update(estimate, observation, kPixelModel, with_method);
    EXPECT_FALSE(outcome.accepted);
    EXPECT_EQ(outcome.status, status);
    EXPECT_EQ(estimate.x, before.x);
    EXPECT_EQ(estimate.P, before.P);
  }
}

TEST(IteratedUpdate, GateRefusesWhatTheMapCannotExplain) {
  Scene scene;
  FeatureEstimate estimate = scene.near_truth();
  estimate.P *= 1e-2;
  Observation observation = scene.feature.observations[0];
  observation.z.x() += 30.0;
  expect_refused(estimate, observation, UpdateStatus::kRejectedByGate);
  UpdateSettings open;
  open.gate = 1e9;
  EXPECT_TRUE(iterated_update(estimate, observation, kPixelModel, open).accepted);
}

TEST(IteratedUpdate, RefusesAFeatureBehindTheCamera) {
  Scene scene;
  FeatureEstimate estimate = scene.near_truth();
  estimate.x(2 * scene.layout.size()) = -300.0;
  expect_refused(estimate, scene.feature.observations[0], UpdateStatus::kBehindCamera);
}

TEST(IteratedUpdate, RefusesNumbersThatAreNotFinite) {
  Scene scene;
  const FeatureEstimate good = scene.near_truth();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, inf}) {
    Observation observation = scene.feature.observations[0];
    observation.z.x() = bad;
    expect_refused(good, observation, UpdateStatus::kNotFinite);
    observation = scene.feature.observations[0];
    observation.R(0, 1) = bad;
    expect_refused(good, observation, UpdateStatus::kNotFinite);
    observation = scene.feature.observations[0];
    observation.X_CW.t.x() = bad;
    expect_refused(good, observation, UpdateStatus::kNotFinite);
    observation = scene.feature.observations[0];
    observation.X_CW.R(2, 2) = bad;
    expect_refused(good, observation, UpdateStatus::kNotFinite);
    observation = scene.feature.observations[0];
    observation.b(1) = bad;
    FeatureEstimate estimate = good;
    EXPECT_FALSE(iterated_update(estimate, observation, kPixelModel).accepted);
    EXPECT_EQ(estimate.P, good.P);
  }
}

TEST(IteratedUpdate, RefusesACovarianceThatIsNotPositive) {
  Scene scene;
  Observation observation = scene.feature.observations[0];
  observation.R << 1.0, 2.0, 2.0, 1.0;
  expect_refused(scene.near_truth(), observation, UpdateStatus::kNotPositive);
  observation.R << -1.0, 0.0, 0.0, 1.0;
  expect_refused(scene.near_truth(), observation, UpdateStatus::kNotPositive);
}

TEST(IteratedUpdate, RefusesABasisOfAnotherLength) {
  Scene scene;
  Observation observation = scene.feature.observations[0];
  observation.b = basis_at(BasisLayout{4, 0}, 0.3);
  expect_refused(scene.near_truth(), observation, UpdateStatus::kSizeMismatch);
  observation.b = Basis();
  expect_refused(scene.near_truth(), observation, UpdateStatus::kSizeMismatch);
}

}  // namespace
}  // namespace perimap

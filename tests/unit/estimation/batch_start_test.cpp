#include "core/estimation/batch_start.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "core/estimation/iterated_update.hpp"
#include "core/estimation/prior_start.hpp"
#include "simulated_feature.hpp"

namespace perimap {
namespace {

using Eigen::MatrixXd;
using test::kBearingDeviation;
using test::kPixelDeviation;
using test::kPixelModel;
using test::path_error;
using test::simulate_feature;
using test::SimulatedFeature;

constexpr int kStart = 60;
constexpr BasisLayout kLayout{.cardiac_harmonics = 5};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

// The posterior Cramer-Rao bound at the truth, as an estimate whose covariance it is.
template <class Model>
FeatureEstimate bound(const Model& model, const SimulatedFeature& feature, std::size_t count, const Prior& prior) {
  MatrixXd information =
      MatrixXd(prior_estimate(kLayout, prior, Vector3d::Zero()).P.diagonal().cwiseInverse().asDiagonal());
  const int n = kLayout.size();
  for (std::size_t k = 0; k < count; ++k) {
    const Observation& o = feature.observations[k];
    MatrixXd B = MatrixXd::Zero(3, 3 * n);
    for (int axis = 0; axis < 3; ++axis) B.block(axis, axis * n, 1, n) = o.b.transpose();
    Vector2d z;
    MeasurementJacobians J;
    EXPECT_EQ(measure(model, o.X_CW, B * feature.x_true, z, &J), ProjectionStatus::kOk);
    const MatrixXd H = J.dz_dp * B;
    information += H.transpose() * o.R.inverse() * H;
  }
  return {feature.x_true, information.inverse()};
}

std::span<const Observation> first(const SimulatedFeature& feature, std::size_t count) {
  return std::span(feature.observations).first(count);
}

TEST(BatchStart, FindsAnExactMotionFromExactObservations) {
  std::mt19937 generator(1);
  for (int i = 0; i < 5; ++i) {
    const BearingModel model;
    SimulatedFeature feature = simulate_feature(model, kLayout, Prior{}, 110, kBearingDeviation, 0.0, generator);
    for (Observation& o : feature.observations) {
      ASSERT_EQ(model.predict(o.X_CW * position_of(feature.x_true, o.b), o.z), ProjectionStatus::kOk);
      o.R *= 1e-6;
    }
    const BatchOutcome start = batch_start(first(feature, 110), model, kLayout, Prior{});
    ASSERT_TRUE(start.ok());
    EXPECT_LT(path_error(start.estimate.x, feature.x_true, kLayout), 0.01);
    EXPECT_EQ(start.inliers, 110);
    EXPECT_EQ(start.estimate.P, start.estimate.P.transpose());
  }
}

// A feature is lost when its path is more than 2 mm off after the start and two more seconds.
struct Losses {
  int lost = 0;
  int features = 0;
};

Losses losses(double outlier_fraction, double depth_factor, unsigned seed) {
  std::mt19937 generator(seed);
  Losses result;
  BatchSettings settings;
  // Three depths about `depth_factor` times the true one.
  settings.start_depths_mm = {50.0 * depth_factor, 90.0 * depth_factor, 160.0 * depth_factor};
  settings.prior_depth_mm = 90.0 * depth_factor;
  for (int i = 0; i < 15; ++i) {
    const SimulatedFeature feature =
        simulate_feature(kPixelModel, kLayout, Prior{}, 120, kPixelDeviation, outlier_fraction, generator);
    const BatchOutcome start = batch_start(first(feature, kStart), kPixelModel, kLayout, Prior{}, settings);
    ++result.features;
    if (!start.ok()) {
      ++result.lost;
      continue;
    }
    FeatureEstimate estimate = start.estimate;
    for (const Observation& o : std::span(feature.observations).subspan(kStart)) {
      iterated_update(estimate, o, kPixelModel);
    }
    result.lost += path_error(estimate.x, feature.x_true, kLayout) > 2.0 ? 1 : 0;
  }
  return result;
}

TEST(BatchStart, LosesNoFeatureFromAnyStartDepth) {
  for (const double factor : {0.35, 0.7, 1.0, 1.7, 3.0}) {
    EXPECT_EQ(losses(0.0, factor, 2).lost, 0) << "start depth " << factor << " times the true one";
  }
}

TEST(BatchStart, LosesHardlyAFeatureToGrossOutliers) {
  Losses all;
  for (const double outliers : {0.05, 0.10}) {
    for (const double factor : {0.5, 1.0, 2.0}) {
      const Losses some = losses(outliers, factor, 3);
      all.lost += some.lost;
      all.features += some.features;
    }
  }
  EXPECT_LE(all.lost, 1) << "of " << all.features;
}

TEST(BatchStart, IsContradictedByObservationsThatNoPeriodicMotionExplains) {
  std::mt19937 generator(7);
  double sum = 0.0;
  constexpr int kFeatures = 20;
  for (int i = 0; i < kFeatures; ++i) {
    SimulatedFeature feature = simulate_feature(kPixelModel, kLayout, Prior{}, kStart, kPixelDeviation, 0.0, generator);
    const BatchOutcome good = batch_start(feature.observations, kPixelModel, kLayout, Prior{});
    ASSERT_TRUE(good.ok());
    EXPECT_FALSE(good.contradicted()) << good.misfit;
    sum += good.misfit;
    // The phases of a clock that takes every second beat for none.
    for (std::size_t k = 0; k < feature.observations.size(); ++k)
      feature.observations[k].b = basis_at(kLayout, 3.67 * static_cast<double>(k) / 30.0);
    const BatchOutcome wrong = batch_start(feature.observations, kPixelModel, kLayout, Prior{});
    EXPECT_TRUE(wrong.contradicted()) << wrong.misfit;
  }
  EXPECT_GT(sum / kFeatures, 0.5);
  EXPECT_LT(sum / kFeatures, 1.1);
}

TEST(BatchStart, TellsInliersFromOutliers) {
  std::mt19937 generator(4);
  const SimulatedFeature feature =
      simulate_feature(kPixelModel, kLayout, Prior{}, kStart, kPixelDeviation, 0.1, generator);
  const BatchOutcome start = batch_start(feature.observations, kPixelModel, kLayout, Prior{});
  ASSERT_TRUE(start.ok());
  ASSERT_EQ(start.inlier.size(), feature.observations.size());
  ASSERT_EQ(start.weights.size(), feature.observations.size());
  int outliers = 0;
  for (std::size_t k = 0; k < feature.observations.size(); ++k) {
    const Observation& o = feature.observations[k];
    Vector2d z;
    ASSERT_EQ(kPixelModel.predict(o.X_CW * position_of(feature.x_true, o.b), z), ProjectionStatus::kOk);
    const bool outlier = (o.z - z).norm() > 10.0 * kPixelDeviation;
    EXPECT_EQ(start.inlier[k] != 0, !outlier) << "observation " << k;
    EXPECT_EQ(start.weights[k] < 0.1, outlier) << "observation " << k;
    outliers += outlier ? 1 : 0;
  }
  EXPECT_GT(outliers, 0);
  EXPECT_EQ(start.inliers, kStart - outliers);
}

TEST(BatchStart, RobustnessCostsNothingOnCleanData) {
  std::mt19937 generator(5);
  std::vector<double> ratios;
  for (int i = 0; i < 25; ++i) {
    const SimulatedFeature feature =
        simulate_feature(kPixelModel, kLayout, Prior{}, kStart, kPixelDeviation, 0.0, generator);
    BatchSettings plain;
    plain.robust = false;
    const BatchOutcome robust_start = batch_start(feature.observations, kPixelModel, kLayout, Prior{});
    const BatchOutcome plain_start = batch_start(feature.observations, kPixelModel, kLayout, Prior{}, plain);
    ASSERT_TRUE(robust_start.ok());
    ASSERT_TRUE(plain_start.ok());
    ratios.push_back(path_error(robust_start.estimate.x, feature.x_true, kLayout) /
                     path_error(plain_start.estimate.x, feature.x_true, kLayout));
  }
  EXPECT_NEAR(median(ratios), 1.0, 0.005);
}

// After the start the recursion must stay at the optimum: as exact as the data allow, and with a covariance that says
// so.
template <class Model>
void expect_efficient_and_consistent(const Model& model, double deviation, unsigned seed) {
  std::mt19937 generator(seed);
  constexpr std::size_t kEnd = 300;
  constexpr int kFeatures = 30;
  double nees = 0.0;
  double squared_error = 0.0;
  double squared_bound = 0.0;
  double squared_error_compared = 0.0;  // of the first features, also solved in one batch
  double squared_error_of_batch = 0.0;
  for (int i = 0; i < kFeatures; ++i) {
    const SimulatedFeature feature =
        simulate_feature(model, kLayout, Prior{}, static_cast<int>(kEnd), deviation, 0.0, generator);
    const BatchOutcome start = batch_start(first(feature, kStart), model, kLayout, Prior{});
    ASSERT_TRUE(start.ok());
    FeatureEstimate estimate = start.estimate;
    for (const Observation& o : std::span(feature.observations).subspan(kStart)) iterated_update(estimate, o, model);
    for (int phase = 0; phase < 8; ++phase) {
      const Basis b = basis_at(kLayout, 0.785 * phase);
      const Vector3d error = estimate.position(b) - position_of(feature.x_true, b);
      nees += error.dot(estimate.position_covariance(b).llt().solve(error)) / (3.0 * 8.0 * kFeatures);
    }
    const double error = path_error(estimate.x, feature.x_true, kLayout);
    squared_error += error * error;
    squared_bound += std::pow(test::path_deviation(bound(model, feature, kEnd, Prior{}), kLayout), 2);
    if (i >= 10) continue;
    const BatchOutcome batch = batch_start(feature.observations, model, kLayout, Prior{});
    ASSERT_TRUE(batch.ok());
    squared_error_compared += error * error;
    squared_error_of_batch += std::pow(path_error(batch.estimate.x, feature.x_true, kLayout), 2);
  }
  // 30 features with a dozen or so independent error components each: about 7 % of scatter.
  EXPECT_NEAR(nees, 1.0, 0.2);
  EXPECT_LT(std::sqrt(squared_error / squared_bound), 1.1);
  EXPECT_GT(std::sqrt(squared_error / squared_bound), 0.85);
  EXPECT_LT(std::sqrt(squared_error_compared / squared_error_of_batch), 1.02);
}

TEST(RecursionAfterBatchStart, IsEfficientAndConsistentForPixels) {
  expect_efficient_and_consistent(kPixelModel, kPixelDeviation, 6);
}
TEST(RecursionAfterBatchStart, IsEfficientAndConsistentForBearings) {
  expect_efficient_and_consistent(BearingModel{}, kBearingDeviation, 7);
}

// Mean NEES/3 of starts from observations whose phases are off at random, told or not told how much.
double nees_with_uncertain_phases(bool told) {
  constexpr double kPhaseDeviation_rad = 0.04;
  constexpr int kFeatures = 30;
  constexpr int kObservations = 150;
  std::mt19937 generator(12);
  std::normal_distribution<double> normal;
  double nees = 0.0;
  for (int i = 0; i < kFeatures; ++i) {
    SimulatedFeature feature =
        simulate_feature(kPixelModel, kLayout, Prior{}, kObservations, kPixelDeviation, 0.0, generator);
    for (Observation& o : feature.observations) {
      const double phase_rad =
          std::atan2(-o.b(1 + kLayout.cardiac_harmonics), o.b(1)) + kPhaseDeviation_rad * normal(generator);
      o.b = basis_at(kLayout, phase_rad);
      if (told) o.b_deviation = basis_rate(kLayout, phase_rad) * kPhaseDeviation_rad;
    }
    const BatchOutcome start = batch_start(feature.observations, kPixelModel, kLayout, Prior{});
    if (!start.ok()) return NAN;
    for (int phase = 0; phase < 8; ++phase) {
      const Basis b = basis_at(kLayout, 0.785 * phase);
      const Vector3d error = start.estimate.position(b) - position_of(feature.x_true, b);
      nees += error.dot(start.estimate.position_covariance(b).llt().solve(error)) / (3.0 * 8.0 * kFeatures);
    }
  }
  return nees;
}

TEST(BatchStart, IsAsUncertainAsThePhasesOfItsObservations) {
  EXPECT_NEAR(nees_with_uncertain_phases(true), 1.0, 0.3);
  EXPECT_GT(nees_with_uncertain_phases(false), 2.0);
}

TEST(BatchStart, IsRepeatableBitByBit) {
  std::mt19937 generator(8);
  const SimulatedFeature feature =
      simulate_feature(kPixelModel, kLayout, Prior{}, kStart, kPixelDeviation, 0.1, generator);
  const BatchOutcome a = batch_start(feature.observations, kPixelModel, kLayout, Prior{});
  const BatchOutcome b = batch_start(feature.observations, kPixelModel, kLayout, Prior{});
  ASSERT_TRUE(a.ok());
  EXPECT_EQ(a.estimate.x, b.estimate.x);
  EXPECT_EQ(a.estimate.P, b.estimate.P);
  EXPECT_EQ(a.iterations, b.iterations);
}

TEST(BatchStart, SaysWhenThereAreTooFewObservations) {
  std::mt19937 generator(9);
  const SimulatedFeature feature = simulate_feature(kPixelModel, kLayout, Prior{}, 9, kPixelDeviation, 0.0, generator);
  EXPECT_EQ(batch_start(feature.observations, kPixelModel, kLayout, Prior{}).status, BatchStatus::kTooFewObservations);
  EXPECT_EQ(batch_start({}, kPixelModel, kLayout, Prior{}).status, BatchStatus::kTooFewObservations);
}

TEST(BatchStart, SaysWhenAnObservationIsUnusable) {
  std::mt19937 generator(10);
  const SimulatedFeature good = simulate_feature(kPixelModel, kLayout, Prior{}, 20, kPixelDeviation, 0.0, generator);
  const auto status_with = [&](auto spoil) {
    std::vector<Observation> observations = good.observations;
    spoil(observations[5]);
    return batch_start(observations, kPixelModel, kLayout, Prior{}).status;
  };
  EXPECT_EQ(status_with([](Observation&) {}), BatchStatus::kOk);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(status_with([&](Observation& o) { o.z.x() = nan; }), BatchStatus::kBadObservation);
  EXPECT_EQ(status_with([&](Observation& o) { o.R(1, 1) = -1.0; }), BatchStatus::kBadObservation);
  EXPECT_EQ(status_with([&](Observation& o) { o.X_CW.t.y() = nan; }), BatchStatus::kBadObservation);
  EXPECT_EQ(status_with([&](Observation& o) { o.b = basis_at(BasisLayout{4, 0}, 0.0); }), BatchStatus::kBadObservation);
}

TEST(BatchStart, SaysWhenTheObservationsAreOfNoOnePoint) {
  std::mt19937 generator(11);
  std::uniform_real_distribution<double> uniform(0.0, 700.0);
  SimulatedFeature feature = simulate_feature(kPixelModel, kLayout, Prior{}, kStart, kPixelDeviation, 0.0, generator);
  for (Observation& o : feature.observations) o.z << uniform(generator), uniform(generator);
  const BatchOutcome start = batch_start(feature.observations, kPixelModel, kLayout, Prior{});
  EXPECT_FALSE(start.ok());
  EXPECT_TRUE(start.status == BatchStatus::kTooManyOutliers || start.status == BatchStatus::kDiverged);
}

TEST(BatchStart, SaysWhenTheFeatureLiesBehindTheCamera) {
  std::mt19937 generator(12);
  SimulatedFeature feature = simulate_feature(kPixelModel, kLayout, Prior{}, kStart, kPixelDeviation, 0.0, generator);
  BatchSettings settings;
  settings.start_depths_mm = {-50.0, -90.0};
  EXPECT_EQ(batch_start(feature.observations, kPixelModel, kLayout, Prior{}, settings).status,
            BatchStatus::kBehindCamera);
}

// The same minimum, whichever way the prior is said.
TEST(BatchStart, FromAPriorThatKnowsNothingIsTheSameAsAlone) {
  std::mt19937 generator(41);
  const SimulatedFeature feature = simulate_feature(kPixelModel, kLayout, Prior{}, 90, kPixelDeviation, 0.0, generator);
  const BatchOutcome alone = batch_start(first(feature, 90), kPixelModel, kLayout, Prior{});
  ASSERT_TRUE(alone.ok());
  const Pose X_WC = feature.observations.front().X_CW.inverse();
  Vector3d ray_C;
  ASSERT_TRUE(kPixelModel.ray(feature.observations.front().z, ray_C));
  const FeaturePrior wide = wide_prior(kLayout, Prior{}, X_WC * (BatchSettings{}.prior_depth_mm * ray_C));
  const BatchOutcome told = start_from_prior(first(feature, 90), kPixelModel, wide).outcome;
  ASSERT_TRUE(told.ok());
  EXPECT_LT((told.estimate.x - alone.estimate.x).norm(), 1e-3);
  EXPECT_LT((told.estimate.P - alone.estimate.P).norm(), 1e-3 * alone.estimate.P.norm());
}

// An elongated, tilted covariance of each element, beside the normal equations written down whole.
TEST(BatchStart, CountsWhatAPriorSaysInEachDirection) {
  std::mt19937 generator(42);
  std::normal_distribution<double> normal;
  const SimulatedFeature feature = simulate_feature(kPixelModel, kLayout, Prior{}, 40, kPixelDeviation, 0.0, generator);
  const int n = kLayout.size();
  FeaturePrior prior;
  prior.x = feature.x_true;
  MatrixXd information = MatrixXd::Zero(3 * n, 3 * n);
  for (int k = 0; k < n; ++k) {
    Matrix3d random;
    for (int i = 0; i < 9; ++i) random(i) = 0.5 * normal(generator);
    const Matrix3d P = random * random.transpose() + 0.01 * Matrix3d::Identity();
    prior.factors_mm[static_cast<std::size_t>(k)] = P.llt().matrixL();
    const Matrix3d inverse = P.inverse();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) information(i * n + k, j * n + k) = inverse(i, j);
    }
  }
  BatchSettings plain;
  plain.robust = false;
  const BatchOutcome start = start_from_prior(first(feature, 40), kPixelModel, prior, plain).outcome;
  ASSERT_TRUE(start.ok());
  MatrixXd posterior = information;
  Eigen::VectorXd gradient = information * (start.estimate.x - prior.x);
  for (const Observation& o : feature.observations) {
    MatrixXd B = MatrixXd::Zero(3, 3 * n);
    for (int axis = 0; axis < 3; ++axis) B.block(axis, axis * n, 1, n) = o.b.transpose();
    Vector2d z;
    MeasurementJacobians J;
    ASSERT_EQ(measure(kPixelModel, o.X_CW, B * start.estimate.x, z, &J), ProjectionStatus::kOk);
    const MatrixXd H = J.dz_dp * B;
    posterior += H.transpose() * o.R.inverse() * H;
    gradient -= H.transpose() * o.R.inverse() * (o.z - z);
  }
  const MatrixXd P = posterior.inverse();
  EXPECT_LT((start.estimate.P - P).norm(), 1e-6 * P.norm());
  EXPECT_LT(std::sqrt(gradient.dot(P * gradient)), 1e-3) << "deviations from the minimum";
  EXPECT_EQ(start.estimate.P, start.estimate.P.transpose());
}

TEST(BatchStart, TellsAPriorThatIsWrong) {
  std::mt19937 generator(43);
  const SimulatedFeature feature = simulate_feature(kPixelModel, kLayout, Prior{}, 40, kPixelDeviation, 0.0, generator);
  FeaturePrior prior;
  prior.x = feature.x_true;
  for (Matrix3d& L : prior.factors_mm) L = 0.1 * Matrix3d::Identity();
  EXPECT_LT(start_from_prior(first(feature, 40), kPixelModel, prior).prior_misfit, 2.0);
  prior.x(2 * kLayout.size()) += 6.0;
  EXPECT_GT(start_from_prior(first(feature, 40), kPixelModel, prior).prior_misfit, 4.0);
}

}  // namespace
}  // namespace perimap

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <bit>
#include <cmath>
#include <iostream>
#include <limits>
#include <numbers>
#include <random>
#include <thread>

#include "bank_estimates.hpp"
#include "bank_on_target.hpp"
#include "core/bank/feature_bank.hpp"
#include "simulated_feature.hpp"

namespace perimap {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::correlated;
using test::estimate_of;
using test::learn;

class BankPrecision : public test::OnEveryTarget {};
INSTANTIATE_TEST_SUITE_P(Simd, BankPrecision, testing::ValuesIn(simd_targets()), test::target_name);

// Features that are followed for some seconds after their start, by a bank of each precision.
template <class Real>
double largest_single_precision_error(FeatureBank<double> exact, FeatureBank<Real> bank) {
  std::mt19937 generator(51);
  const BasisLayout layout = exact.layout();
  std::vector<test::SimulatedFeature> features;
  for (int f = 0; f < kLanes; ++f) {
    features.push_back(test::simulate_feature(test::kPixelModel, layout, Prior{}, 300, 0.7, 0.0, generator));
    FeatureEstimate start = correlated(Vector3d::Zero(), layout, 0.3, generator);
    start.x += features.back().x_true;
    exact.set(f, start);
    bank.set(f, start);
  }
  for (std::size_t k = 0; k < 300; ++k) {
    for (int f = 0; f < kLanes; ++f) {
      const Observation& observation = features[static_cast<std::size_t>(f)].observations[k];
      EXPECT_EQ(learn(exact, f, observation, test::kPixelModel).accepted,
                learn(bank, f, observation, test::kPixelModel).accepted);
    }
  }
  double largest = 0.0;
  for (int f = 0; f < kLanes; ++f) {
    const StateVector difference = estimate_of(exact, f).x - estimate_of(bank, f).x;
    for (int i = 0; i < 24; ++i) {
      const double phase = 2.0 * std::numbers::pi * i / 24;
      largest = std::max(largest, position_of(difference, basis_at(layout, phase)).norm());
    }
  }
  return largest;
}

TEST_P(BankPrecision, SinglePrecisionKeepsPositionsToMicrometres) {
  const BasisLayout layout{5, 0};
  EXPECT_LT(largest_single_precision_error(bank<double>(layout, kLanes), bank<float>(layout, kLanes)), 5e-4);
}

// The smallest eigenvalue of the correlations of P; negative infinity when a variance is not positive.
template <class Real>
double least_eigenvalue(const FeatureBank<Real>& bank, int feature) {
  const MatrixXd P = estimate_of(bank, feature).P;
  if (!(P.diagonal().array() > 0.0).all()) return -std::numeric_limits<double>::infinity();
  const VectorXd scale = P.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(MatrixXd(scale.asDiagonal() * P * scale.asDiagonal()),
                                                       Eigen::EigenvaluesOnly);
  return solver.eigenvalues()(0);
}

// `updates` of each feature, on all of them at once, from the wide prior on. Without a gate: some features lose their
// depth to a start on the first ray and would learn no more, but P must stay sound for them as well. Lanes 0, 3 and 6
// of each group also take process noise with each update. The eigenvalues are looked at often while there is little
// data, which leaves P worst conditioned, then ten times on the way. Returns the least of them.
template <class Real>
double least_eigenvalue_over(FeatureBank<Real> bank, int updates) {
  std::mt19937 generator(61);
  std::normal_distribution<double> normal;
  const BasisLayout layout = bank.layout();
  std::vector<StateVector> truths;
  for (int f = 0; f < bank.features(); ++f) {
    FeatureEstimate start = prior_estimate(layout, Prior{}, Vector3d(f % 5, f % 3, 0.0));
    truths.push_back(start.x);
    bank.set(f, start);
  }
  UpdateSettings open;
  open.gate = std::numeric_limits<double>::infinity();
  constexpr double kNoise_mm = 0.01 * 0.18;  // of the process in 1/30 s, at 0.01 mm per square root of a second
  double phase = 0.0;
  double least = std::numeric_limits<double>::infinity();
  long accepted = 0;
  for (int k = 0; k < updates; ++k) {
    phase += 0.25 + 1e-3 * normal(generator);
    const Pose X_CW = test::camera_pose(k / 30.0, false, 0.0);
    SweepPhases<Real> phases;
    const Basis b = basis_at(layout, phase);
    phases.add_learnt(b, Basis());
    for (int g = 0; g < bank.groups(); ++g) {
      LaneObservations<Real> measured;
      for (int lane = 0; lane < kLanes; ++lane) {
        Vector2d z = Vector2d::Zero();
        const StateVector& truth = truths[static_cast<std::size_t>(g * kLanes + lane)];
        EXPECT_EQ(test::kPixelModel.predict(X_CW * position_of(truth, b), z), ProjectionStatus::kOk);
        measured.set(lane, z + 0.7 * Vector2d(normal(generator), normal(generator)), 0.49 * Matrix2d::Identity());
        if (lane % 3 == 0) bank.diffuse(g * kLanes + lane, kNoise_mm);
      }
      LaneOutcomes<Real> outcomes;
      bank.sweep(g, phases);
      bank.update(g, phases, 0, X_CW, test::kPixelModel, measured, open, outcomes);
      accepted += std::popcount(outcomes.accepted);
    }
    const int learnt = k + 1;
    if (learnt != 3 && learnt != 10 && learnt != 30 && learnt != 100 && learnt % (updates / 10) != 0) continue;
    for (int f = 0; f < bank.features(); ++f) least = std::min(least, least_eigenvalue(bank, f));
  }
  EXPECT_GT(static_cast<double>(accepted), 0.99 * updates * bank.features());
  return least;
}

constexpr BasisLayout kShipped{.cardiac_harmonics = 8};
#ifdef PERIMAP_SANITIZER
constexpr int kShortRun = 500;
constexpr int kMillionRun = 500;
#else
constexpr int kShortRun = 2'000;
constexpr int kMillionRun = 62'500;  // of each of 16 features
#endif

// 10^6 updates in all on the best path; a short run on the others.
TEST_P(BankPrecision, CovarianceStaysPositiveDefiniteOverAMillionUpdates) {
  const double least = least_eigenvalue_over(bank<double>(kShipped, 2 * kLanes),
                                             GetParam() == best_simd_target() ? kMillionRun : kShortRun);
  std::cout << "least eigenvalue of the correlations: " << least << std::endl;
  EXPECT_GT(least, 1e-9);
}

TEST_P(BankPrecision, CovarianceStaysPositiveDefiniteInSinglePrecision) {
  const double least = least_eigenvalue_over(bank<float>(kShipped, 2 * kLanes),
                                             GetParam() == best_simd_target() ? kMillionRun : kShortRun);
  std::cout << "least eigenvalue of the correlations: " << least << std::endl;
  EXPECT_GT(least, 0.0);
}

TEST_P(BankPrecision, CovarianceStaysPositiveDefiniteWithFewHarmonics) {
  EXPECT_GT(least_eigenvalue_over(bank<double>({1, 0}, 2 * kLanes), kShortRun), 1e-9);
}

}  // namespace
}  // namespace perimap

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

using test::correlated;
using test::estimate_of;
using test::expect_close;
using test::expect_identical;
using test::kDistorted;
using test::kFisheye;
using test::learn;

class BankAtUglyPoints : public test::OnEveryTarget {};
INSTANTIATE_TEST_SUITE_P(Simd, BankAtUglyPoints, testing::ValuesIn(simd_targets()), test::target_name);

struct UglyCase {
  const char* name;
  Vector3d p_C;        // where the feature is thought to be, frame C
  Vector2d offset_px;  // of the measurement from where it would be seen
  double deviation_mm;
  double noise_px;
};

const UglyCase kUglyCases[] = {
    {"plain", {10, -5, 90}, {1, -2}, 1.0, 0.7},
    {"on the optical axis", {0, 0, 80}, {0.3, 0.2}, 1.0, 0.7},
    {"near the optical axis", {1e-7, -1e-7, 80}, {0.3, 0.2}, 1.0, 0.7},
    {"image corner", {50, 38, 88}, {-2, 1}, 1.0, 0.7},
    {"beyond the image", {70, 50, 88}, {2, 1}, 1.0, 0.7},
    {"folded back", {400, 300, 90}, {0.2, 0.1}, 0.1, 0.7},
    {"behind the camera", {5, 5, -60}, {0.2, 0.1}, 1.0, 0.7},
    {"close to the camera", {0.5, 0.2, 3}, {5, 5}, 0.2, 2.0},
    {"wide prior and a close look", {3, 2, 20}, {60, 40}, 6.0, 1.0},
    {"refused by the gate", {10, -5, 90}, {400, 300}, 0.1, 0.7},
    {"just one axis off", {10, -5, 90}, {200, 0}, 3.0, 5.0},
};

struct UglyUpdate {
  FeatureEstimate before;
  Observation observation;
};

template <class Model>
UglyUpdate ugly_update(const Model& model, const BasisLayout& layout, const UglyCase& ugly, std::mt19937& generator) {
  constexpr bool kBearing = std::is_same_v<Model, BearingModel>;
  const Pose X_CW = test::camera_pose(0.3, kBearing, 0.4);
  // In the bearing's frame x is ahead.
  const Vector3d p_C = kBearing ? Vector3d(ugly.p_C.z(), -ugly.p_C.x(), -ugly.p_C.y()) : ugly.p_C;
  UglyUpdate update{correlated(X_CW.inverse() * p_C, layout, ugly.deviation_mm, generator), {}};
  Observation& observation = update.observation;
  observation.b = basis_at(layout, 0.7, 0.2);
  observation.X_CW = X_CW;
  const double unit = kBearing ? 1.0 / 600.0 : 1.0;
  const double variance = std::pow(unit * ugly.noise_px, 2);
  observation.R << variance, 0.2 * variance, 0.2 * variance, 1.5 * variance;
  if (model.predict(X_CW * position_of(update.before.x, observation.b), observation.z) != ProjectionStatus::kOk) {
    observation.z.setZero();
  }
  observation.z += unit * ugly.offset_px;
  return update;
}

template <class Model>
void expect_scalar_update(const Model& model, FeatureBank<double> bank, const UglyCase& ugly,
                          const UpdateSettings& settings, std::mt19937& generator) {
  SCOPED_TRACE(ugly.name);
  constexpr int kFeature = kLanes + 5;
  const auto [before, observation] = ugly_update(model, bank.layout(), ugly, generator);
  FeatureEstimate scalar = before;

  bank.set(kFeature, before);
  const LaneOutcomes<double> lanes = learn(bank, kFeature, observation, model, settings);
  const UpdateOutcome expected = iterated_update(scalar, observation, model, settings);
  constexpr int kLane = kFeature % kLanes;
  EXPECT_EQ(lanes.considered, 1 << kLane);
  EXPECT_EQ(lanes.accepted, expected.accepted ? 1 << kLane : 0);
  EXPECT_EQ(lanes.status[kLane], expected.status);
  EXPECT_EQ(lanes.iterations[kLane], expected.iterations);
  const double z_error = 1e-12 * (1.0 + observation.z.norm());
  const double deviation = std::sqrt(observation.R(0, 0));
  EXPECT_NEAR(lanes.innovation[0][kLane], expected.innovation.x(), z_error);
  EXPECT_NEAR(lanes.innovation[1][kLane], expected.innovation.y(), z_error);
  // An error e of a residual of s deviations is one of 2 s e of its square.
  const auto cost_error = [&](double cost) { return 1e-12 * cost + 4.0 * std::sqrt(cost) * z_error / deviation; };
  EXPECT_NEAR(lanes.normalised_innovation_squared[kLane], expected.normalised_innovation_squared,
              cost_error(expected.normalised_innovation_squared));
  EXPECT_NEAR(lanes.map_cost[kLane], expected.map_cost, cost_error(expected.normalised_innovation_squared));
  if (expected.accepted) {
    expect_close(estimate_of(bank, kFeature), scalar, 1e-12);
  } else {
    expect_identical(estimate_of(bank, kFeature), before);
  }
}

TEST_P(BankAtUglyPoints, UpdatesAsTheScalarUpdateAtUglyPoints) {
  std::mt19937 generator(31);
  UpdateSettings newton;
  newton.method = UpdateMethod::kGaussNewton;
  newton.step_factor = 0.7;
  newton.covariance = CovarianceLinearisation::kLastStep;
  UpdateSettings open;
  open.gate = 1e12;
  for (const BasisLayout layout :
       {BasisLayout{0, 0}, BasisLayout{1, 0}, BasisLayout{3, 0}, BasisLayout{8, 0}, BasisLayout{12, 2}}) {
    SCOPED_TRACE("basis of " + std::to_string(layout.size()));
    for (const UpdateSettings& settings : {UpdateSettings{}, newton, open}) {
      for (const UglyCase& ugly : kUglyCases) {
        expect_scalar_update(test::kPixelModel, bank(layout, 2 * kLanes), ugly, settings, generator);
        expect_scalar_update(kDistorted, bank(layout, 2 * kLanes), ugly, settings, generator);
        expect_scalar_update(kFisheye, bank(layout, 2 * kLanes), ugly, settings, generator);
        expect_scalar_update(BearingModel{}, bank(layout, 2 * kLanes), ugly, settings, generator);
      }
    }
  }
}

// An instruction set whose kernels were built but which this machine lacks is not tested here: said, not passed over.
TEST(BankPaths, EveryInstructionSetIsTested) {
  std::string tested;
  for (const SimdTarget target : simd_targets()) tested += std::string(" ") + simd_target_name(target);
  std::string missing;
  for (const char* name : {"AVX3", "AVX2", "SSE4"}) {
    if (tested.find(name) == std::string::npos) missing += std::string(" ") + name;
  }
  if (!missing.empty()) {
    GTEST_SKIP() << "not on this machine, or not compiled in:" << missing
                 << "; the tests of the bank ran on:" << tested;
  }
  std::cout << "the tests of the bank run on:" << tested << '\n';
  EXPECT_GE(simd_targets().size(), 3U);
}

TEST(BankPaths, AgreeOnASingleUpdate) {
  const std::vector<SimdTarget> targets = simd_targets();
  if (targets.size() < 2) GTEST_SKIP() << "only " << simd_target_name(targets.front()) << " is on this machine";
  std::mt19937 generator(33);
  constexpr int kFeature = 3;
  int accepted = 0;
  for (const BasisLayout layout : {BasisLayout{1, 0}, BasisLayout{5, 0}, BasisLayout{8, 0}, BasisLayout{12, 2}}) {
    for (const UglyCase& ugly : kUglyCases) {
      const auto [before, observation] = ugly_update(kDistorted, layout, ugly, generator);
      const auto learnt_on = [&](SimdTarget target, FeatureEstimate& estimate) {
        FeatureBank<double> bank({.layout = layout, .features = kLanes, .target = target});
        bank.set(kFeature, before);
        const LaneOutcomes<double> outcomes = learn(bank, kFeature, observation, kDistorted);
        estimate = estimate_of(bank, kFeature);
        return outcomes;
      };
      FeatureEstimate best;
      const LaneOutcomes<double> expected = learnt_on(targets.front(), best);
      accepted += expected.accepted != 0 ? 1 : 0;
      for (std::size_t t = 1; t < targets.size(); ++t) {
        SCOPED_TRACE(std::string(ugly.name) + " on " + simd_target_name(targets[t]));
        FeatureEstimate other;
        const LaneOutcomes<double> outcomes = learnt_on(targets[t], other);
        EXPECT_EQ(outcomes.accepted, expected.accepted);
        EXPECT_EQ(outcomes.status[kFeature], expected.status[kFeature]);
        EXPECT_EQ(outcomes.iterations[kFeature], expected.iterations[kFeature]);
        expect_close(other, best, 1e-12);
      }
    }
  }
  EXPECT_GT(accepted, 20);
}

TEST_P(BankAtUglyPoints, RefusesBadNumbersAsTheScalarUpdate) {
  std::mt19937 generator(32);
  const BasisLayout layout{3, 0};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const FeatureEstimate before = correlated(Vector3d(5, 3, 10), layout, 1.0, generator);
  Observation good;
  good.b = basis_at(layout, 0.4);
  good.X_CW = test::camera_pose(0.0, false, 0.0);
  ASSERT_EQ(test::kPixelModel.predict(good.X_CW * position_of(before.x, good.b), good.z), ProjectionStatus::kOk);
  std::vector<Observation> bad(7, good);
  bad[0].z.x() = nan;
  bad[1].z.y() = inf;
  bad[2].R(0, 1) = bad[2].R(1, 0) = nan;
  bad[3].R << 1, 2, 2, 1;
  bad[4].R << -1, 0, 0, 1;
  bad[5].X_CW.t.x() = inf;
  bad[6].b(1) = nan;
  for (std::size_t i = 0; i < bad.size(); ++i) {
    SCOPED_TRACE(i);
    FeatureBank<double> bank = this->bank(layout, 1);
    bank.set(2, before);
    FeatureEstimate scalar = before;
    const UpdateOutcome expected = iterated_update(scalar, bad[i], test::kPixelModel);
    const LaneOutcomes<double> lanes = learn(bank, 2, bad[i], test::kPixelModel);
    EXPECT_EQ(lanes.accepted, 0);
    EXPECT_EQ(lanes.status[2], expected.status);
    expect_identical(estimate_of(bank, 2), before);
  }
}

}  // namespace
}  // namespace perimap

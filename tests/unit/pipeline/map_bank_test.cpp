#include "core/pipeline/map_bank.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "tests/unit/estimation/simulated_feature.hpp"

namespace perimap {
namespace {

constexpr int kFeatures = 11;  // a whole group and a part of one
constexpr int kFrames = 300;
constexpr BasisLayout kLayout{.cardiac_harmonics = 5, .respiratory_harmonics = 2};
const BankSettings kSettings{.layout = kLayout, .features = kFeatures};
constexpr double kRate_rad_per_s = 7.0;

// What a group's frame gave: everything that the pipeline asks of a bank.
template <class Real>
struct GroupTold {
  LaneMotions<Real> learnt;  // at the learnt phase, before the update
  LaneMotions<Real> predicted;
  LaneMotions<Real> near;  // a little later than predicted
  LaneOutcomes<Real> outcomes;
  PositionGain gain;  // of the group's first feature, after the update
};

// Beating points in view of one camera, 30 frames a second; some matches are missing, some are outliers.
struct Scene {
  std::vector<StateVector> truths;
  std::vector<FeatureEstimate> starts;

  Scene() {
    std::mt19937 generator(17);
    std::normal_distribution<double> normal;
    for (int f = 0; f < kFeatures; ++f) {
      const auto feature = test::simulate_feature(test::kPixelModel, kLayout, Prior{}, 1, 0.7, 0.0, generator);
      truths.push_back(feature.x_true);
      FeatureEstimate start = prior_estimate(kLayout, Prior{}, Vector3d::Zero());
      start.P *= 1e-2;
      start.x = feature.x_true;
      for (Eigen::Index i = 0; i < start.x.size(); ++i) start.x(i) += std::sqrt(start.P(i, i)) * normal(generator);
      starts.push_back(start);
    }
  }

  template <class Bank>
  void begin(Bank& bank) const {
    for (int f = 0; f < kFeatures; ++f) bank.set(f, starts[static_cast<std::size_t>(f)]);
  }

  // Sweep, motions, update, gain and diffusion of a group in frame k, as the pipeline makes them.
  template <class Real, class Bank>
  GroupTold<Real> frame(Bank& bank, int group, int k) const {
    std::mt19937 noise(static_cast<unsigned>(1000 * group + k));
    std::normal_distribution<double> normal(0.0, 0.3);
    const double phase_rad = kRate_rad_per_s * k / 30.0;
    const double breath_rad = 1.4 * k / 30.0;
    const Pose X_CW = test::camera_pose(k / 30.0, false, 0.5);
    const Basis b = basis_at(kLayout, phase_rad, breath_rad);
    SweepPhases<Real> phases;
    phases.add_learnt(b, basis_rate(kLayout, phase_rad), kRate_rad_per_s);
    phases.add_predicted(basis_at(kLayout, phase_rad + 0.3, breath_rad), basis_rate(kLayout, phase_rad + 0.3),
                         kRate_rad_per_s, 0.005);
    SweepPhase<Real> at;
    at.set(basis_at(kLayout, phase_rad + 0.35, breath_rad), basis_rate(kLayout, phase_rad + 0.35), kRate_rad_per_s,
           0.0);
    LaneObservations<Real> observations;
    for (int lane = 0; lane < kLanes && group * kLanes + lane < kFeatures; ++lane) {
      Vector2d z;
      const Vector3d q = X_CW * position_of(truths[static_cast<std::size_t>(group * kLanes + lane)], b);
      EXPECT_EQ(test::kPixelModel.predict(q, z), ProjectionStatus::kOk);
      const bool outlier = (k + lane) % 29 == 0;
      z += Vector2d(normal(noise) + (outlier ? 60.0 : 0.0), normal(noise));
      if ((k + lane) % 7 != 0) observations.set(lane, z, 0.09 * Matrix2d::Identity());
    }
    GroupTold<Real> told;
    bank.sweep(group, phases);
    bank.motion(group, phases, 0, told.learnt);
    bank.motion(group, phases, 1, told.predicted);
    bank.motion_near(group, phases, 1, at, told.near);
    bank.update(group, phases, 0, X_CW, test::kPixelModel, observations, UpdateSettings{}, told.outcomes);
    bank.position_gain(group * kLanes, phases, 0, told.gain);
    if (k % 50 == 49) bank.diffuse(group * kLanes, 0.2);
    return told;
  }
};

template <class Bank>
FeatureEstimate estimate_of(const Bank& bank, int feature) {
  FeatureEstimate estimate;
  bank.get(feature, estimate);
  return estimate;
}

template <class Real>
void expect_the_bank_itself(Precision precision) {
  const Scene scene;
  MapBank map(kSettings, precision);
  FeatureBank<Real> bank(kSettings);
  ASSERT_EQ(map.groups(), bank.groups());
  scene.begin(map);
  scene.begin(bank);
  for (int k = 0; k < kFrames; ++k) {
    for (int g = 0; g < map.groups(); ++g) {
      const auto ours = scene.frame<double>(map, g, k);
      const auto its = scene.frame<Real>(bank, g, k);
      for (const auto& [a, b] : {std::pair(&ours.learnt, &its.learnt), std::pair(&ours.predicted, &its.predicted),
                                 std::pair(&ours.near, &its.near)}) {
        ASSERT_EQ(a->valid, b->valid);
        for (int lane = 0; lane < kLanes; ++lane) {
          ASSERT_EQ(a->position_of(lane), b->position_of(lane));
          ASSERT_EQ(a->velocity_of(lane), b->velocity_of(lane));
          ASSERT_EQ(a->covariance_of(lane), b->covariance_of(lane));
        }
      }
      ASSERT_EQ(ours.outcomes.considered, its.outcomes.considered);
      ASSERT_EQ(ours.outcomes.accepted, its.outcomes.accepted);
      for (int lane = 0; lane < kLanes; ++lane) {
        ASSERT_EQ(ours.outcomes.status[lane], its.outcomes.status[lane]);
        ASSERT_EQ(ours.outcomes.iterations[lane], its.outcomes.iterations[lane]);
        ASSERT_EQ(ours.outcomes.map_cost[lane], double(its.outcomes.map_cost[lane]));
        ASSERT_EQ(ours.outcomes.normalised_innovation_squared[lane],
                  double(its.outcomes.normalised_innovation_squared[lane]));
        for (int axis = 0; axis < 2; ++axis) {
          ASSERT_EQ(ours.outcomes.innovation[axis][lane], double(its.outcomes.innovation[axis][lane]));
        }
      }
      ASSERT_EQ(ours.gain, its.gain);
    }
  }
  for (int f = 0; f < kFeatures; ++f) {
    EXPECT_EQ(estimate_of(map, f).x, estimate_of(bank, f).x);
    EXPECT_EQ(estimate_of(map, f).P, estimate_of(bank, f).P);
  }
}

TEST(MapBank, InDoublePrecisionIsTheBankBitForBit) { expect_the_bank_itself<double>(Precision::kDouble); }

TEST(MapBank, InSinglePrecisionIsTheBankOfFloatsBitForBit) { expect_the_bank_itself<float>(Precision::kSingle); }

TEST(MapBank, BothPrecisionsAcceptTheSameAndAgreeWithinFloatsAccuracy) {
  const Scene scene;
  MapBank exact(kSettings, Precision::kDouble);
  MapBank single(kSettings, Precision::kSingle);
  scene.begin(exact);
  scene.begin(single);
  int accepted = 0;
  int refused = 0;
  double largest_mm = 0.0;
  double largest_of_covariance = 0.0;
  for (int k = 0; k < kFrames; ++k) {
    for (int g = 0; g < exact.groups(); ++g) {
      const auto a = scene.frame<double>(exact, g, k);
      const auto b = scene.frame<double>(single, g, k);
      ASSERT_EQ(a.outcomes.considered, b.outcomes.considered);
      ASSERT_EQ(a.outcomes.accepted, b.outcomes.accepted);
      for (int lane = 0; lane < kLanes && g * kLanes + lane < kFeatures; ++lane) {
        largest_mm = std::max(largest_mm, (a.near.position_of(lane) - b.near.position_of(lane)).norm());
        const Matrix3d S = a.near.covariance_of(lane);
        largest_of_covariance = std::max(largest_of_covariance, (S - b.near.covariance_of(lane)).norm() / S.norm());
        if ((a.outcomes.considered >> lane & 1) == 0) continue;
        ((a.outcomes.accepted >> lane & 1) != 0 ? accepted : refused) += 1;
      }
    }
  }
  EXPECT_LT(largest_mm, 3e-3) << "GCC's and clang's kernels round in other places: 1 and 1.4 um";
  EXPECT_GT(largest_mm, 0.0) << "they are not the same";
  // What is left of a far larger one, so it has lost some digits.
  EXPECT_LT(largest_of_covariance, 1e-2);
  EXPECT_GT(accepted, kFeatures * kFrames / 2);
  EXPECT_GT(refused, 20) << "outliers";
}

struct InBothPrecisions : testing::TestWithParam<Precision> {
  MapBank bank{kSettings, GetParam()};
};

TEST_P(InBothPrecisions, WhatIsSetIsThereAsFarAsThePrecisionGoes) {
  const Scene scene;
  scene.begin(bank);
  for (int f = 0; f < kFeatures; ++f) {
    const FeatureEstimate& start = scene.starts[static_cast<std::size_t>(f)];
    StateVector x;
    bank.get(f, x);
    EXPECT_EQ(x, estimate_of(bank, f).x);
    if (GetParam() == Precision::kDouble) {
      EXPECT_EQ(x, start.x);
      EXPECT_EQ(estimate_of(bank, f).P, start.P);
    } else {
      EXPECT_EQ(x, StateVector(start.x.cast<float>().cast<double>()));
      EXPECT_EQ(estimate_of(bank, f).P, StateMatrix(start.P.cast<float>().cast<double>()));
    }
  }
}

TEST_P(InBothPrecisions, AFeatureThatIsClearedIsGoneAndItsNeighboursStay) {
  const Scene scene;
  scene.begin(bank);
  bank.clear(3);
  EXPECT_EQ(estimate_of(bank, 3).P.norm(), 0.0);
  const auto told = scene.frame<double>(bank, 0, 0);
  EXPECT_EQ(told.learnt.valid, 0xF7);
  EXPECT_EQ(told.outcomes.considered >> 3 & 1, 0);
  EXPECT_EQ(scene.frame<double>(bank, 1, 0).learnt.valid, 0x07);
}

TEST_P(InBothPrecisions, DiffusionWidensTheCovarianceOfOneFeature) {
  const Scene scene;
  scene.begin(bank);
  const double before_mm2 = estimate_of(bank, 2).P(0, 0);
  const double neighbour_mm2 = estimate_of(bank, 1).P(0, 0);
  bank.diffuse(2, 0.5);
  EXPECT_NEAR(estimate_of(bank, 2).P(0, 0), before_mm2 + 0.25, 1e-5);
  EXPECT_EQ(estimate_of(bank, 1).P(0, 0), neighbour_mm2);
}

INSTANTIATE_TEST_SUITE_P(MapBank, InBothPrecisions, testing::Values(Precision::kDouble, Precision::kSingle),
                         [](const auto& param) { return param.param == Precision::kDouble ? "Double" : "Single"; });

}  // namespace
}  // namespace perimap

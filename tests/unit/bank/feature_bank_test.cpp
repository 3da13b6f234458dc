#include "core/bank/feature_bank.hpp"

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

#include "bank_on_target.hpp"
#include "simulated_feature.hpp"

namespace perimap {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::estimate_of;
using test::kFisheye;
using test::learn;

class Bank : public test::OnEveryTarget {};
INSTANTIATE_TEST_SUITE_P(Simd, Bank, testing::ValuesIn(simd_targets()), test::target_name);

const PixelModel kDistorted{CameraModel{.width = 640,
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
FeatureEstimate correlated(const Vector3d& p_WF, const BasisLayout& layout, double deviation, std::mt19937& generator) {
  std::normal_distribution<double> normal;
  const int d = layout.state_size();
  MatrixXd A(d, d);
  for (double& value : A.reshaped()) value = 0.1 * normal(generator);
  const MatrixXd P = deviation * deviation * (A * A.transpose() + MatrixXd::Identity(d, d));
  FeatureEstimate estimate{StateVector::Zero(d), StateMatrix(P.selfadjointView<Eigen::Lower>())};
  for (double& value : estimate.x) value = 0.2 * deviation * normal(generator);
  for (int axis = 0; axis < 3; ++axis) estimate.x(axis * layout.size()) += p_WF(axis);
  return estimate;
}

double largest_difference(const MatrixXd& a, const MatrixXd& b) { return (a - b).cwiseAbs().maxCoeff(); }

void expect_close(const FeatureEstimate& got, const FeatureEstimate& expected, double tolerance) {
  EXPECT_LT(largest_difference(got.x, expected.x), tolerance * expected.x.cwiseAbs().maxCoeff());
  EXPECT_LT(largest_difference(got.P, expected.P), tolerance * expected.P.cwiseAbs().maxCoeff());
}

void expect_identical(const FeatureEstimate& got, const FeatureEstimate& expected) {
  EXPECT_EQ(got.x, expected.x);
  EXPECT_EQ(got.P, expected.P);
}

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

TEST_P(Bank, UpdatesAsTheScalarUpdateAtUglyPoints) {
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

TEST_P(Bank, RefusesBadNumbersAsTheScalarUpdate) {
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

// A group's worth of features and what is seen of them in some held frames.
struct Group {
  BasisLayout layout{5, 1};
  std::vector<FeatureEstimate> estimates;
  struct Held {
    Pose X_CW;
    Basis b;
    std::vector<Vector2d> z;
    Matrix2d R = 0.5 * Matrix2d::Identity();
  };
  std::vector<Held> frames;

  Group(int features, int count, unsigned seed) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> place(-15.0, 15.0);
    std::normal_distribution<double> normal;
    for (int f = 0; f < features; ++f) {
      estimates.push_back(
          correlated(Vector3d(place(generator), place(generator), place(generator)), layout, 0.5, generator));
    }
    for (int i = 0; i < count; ++i) {
      Held held;
      held.X_CW = test::camera_pose(0.11 * i, false, 0.2);
      held.b = basis_at(layout, 0.5 + 0.9 * i, 0.3 * i);
      for (const FeatureEstimate& estimate : estimates) {
        Vector2d z = Vector2d::Zero();
        (void)kDistorted.predict(held.X_CW * position_of(estimate.x, held.b), z);
        held.z.push_back(z + Vector2d(normal(generator), normal(generator)));
      }
      frames.push_back(held);
    }
  }
  Observation observation(int frame, int feature) const {
    const Held& held = frames[static_cast<std::size_t>(frame)];
    return {held.z[static_cast<std::size_t>(feature)], held.R, held.b, held.X_CW};
  }
};

template <class Real>
void fill(FeatureBank<Real>& bank, const Group& group) {
  for (std::size_t f = 0; f < group.estimates.size(); ++f) bank.set(static_cast<int>(f), group.estimates[f]);
}

// Learns the frames in one sweep; which features are seen in frame i says seen(i, feature).
template <class Real, class Seen>
void learn_in_one_sweep(FeatureBank<Real>& bank, const Group& group, Seen seen) {
  SweepPhases<Real> phases;
  for (const Group::Held& held : group.frames) ASSERT_GE(phases.add_learnt(held.b, Basis()), 0);
  for (int g = 0; g < bank.groups(); ++g) {
    bank.sweep(g, phases);
    for (int i = 0; i < phases.count(); ++i) {
      LaneObservations<Real> measured;
      for (int lane = 0; lane < kLanes; ++lane) {
        const int feature = g * kLanes + lane;
        if (feature >= static_cast<int>(group.estimates.size()) || !seen(i, feature)) continue;
        const Observation observation = group.observation(i, feature);
        measured.set(lane, observation.z, observation.R);
      }
      LaneOutcomes<Real> outcomes;
      bank.update(g, phases, i, group.frames[static_cast<std::size_t>(i)].X_CW, kDistorted, measured, UpdateSettings{},
                  outcomes);
      EXPECT_EQ(outcomes.considered, measured.measured);
    }
  }
}

TEST_P(Bank, SeveralPendingUpdatesEqualOneByOne) {
  const Group group(kLanes, kMaxPendingUpdates, 41);
  FeatureBank<double> bank = this->bank(group.layout, kLanes);
  fill(bank, group);
  const auto seen = [](int frame, int feature) { return (frame + feature) % 3 != 0; };
  learn_in_one_sweep(bank, group, seen);
  for (const bool flushed : {false, true}) {
    if (flushed) bank.sweep(0, SweepPhases<double>{});
    for (int f = 0; f < kLanes; ++f) {
      FeatureEstimate scalar = group.estimates[static_cast<std::size_t>(f)];
      for (int i = 0; i < kMaxPendingUpdates; ++i) {
        if (seen(i, f)) (void)iterated_update(scalar, group.observation(i, f), kDistorted);
      }
      expect_close(estimate_of(bank, f), scalar, 1e-12);
    }
  }
}

TEST_P(Bank, LanesWithoutMeasurementStayAsTheyWere) {
  const Group group(kLanes, 2, 42);
  FeatureBank<double> bank = this->bank(group.layout, kLanes);
  fill(bank, group);
  learn_in_one_sweep(bank, group, [](int, int feature) { return feature == 2 || feature == 7; });
  bank.sweep(0, SweepPhases<double>{});
  for (int f = 0; f < kLanes; ++f) {
    const FeatureEstimate& before = group.estimates[static_cast<std::size_t>(f)];
    if (f == 2 || f == 7) {
      EXPECT_NE(estimate_of(bank, f).x, before.x);
    } else {
      expect_identical(estimate_of(bank, f), before);
    }
  }
}

TEST_P(Bank, ResultsDoNotDependOnLaneGroupOrWorkers) {
  const Group group(3 * kLanes - 1, 3, 43);
  const auto seen = [](int frame, int feature) { return (frame + 2 * feature) % 5 != 0; };
  FeatureBank<double> straight = bank(group.layout, 3 * kLanes);
  fill(straight, group);
  learn_in_one_sweep(straight, group, seen);

  // The same features in other places, in a larger bank, by two workers.
  Group moved = group;
  std::vector<int> from(group.estimates.size());
  for (std::size_t i = 0; i < from.size(); ++i) from[i] = static_cast<int>(i);
  std::mt19937 generator(44);
  std::shuffle(from.begin(), from.end(), generator);
  for (std::size_t f = 0; f < from.size(); ++f) {
    const auto source = static_cast<std::size_t>(from[f]);
    moved.estimates[f] = group.estimates[source];
    for (std::size_t i = 0; i < group.frames.size(); ++i) moved.frames[i].z[f] = group.frames[i].z[source];
  }
  FeatureBank<double> shuffled = bank(group.layout, 5 * kLanes);
  fill(shuffled, moved);
  SweepPhases<double> phases;
  for (const Group::Held& held : moved.frames) phases.add_learnt(held.b, Basis());
  const auto work = [&](int worker) {
    for (int g = worker; g < shuffled.groups(); g += 2) {
      shuffled.sweep(g, phases);
      for (int i = 0; i < phases.count(); ++i) {
        LaneObservations<double> measured;
        for (int lane = 0; lane < kLanes; ++lane) {
          const int feature = g * kLanes + lane;
          if (feature >= static_cast<int>(from.size()) || !seen(i, from[static_cast<std::size_t>(feature)])) continue;
          const Observation observation = moved.observation(i, feature);
          measured.set(lane, observation.z, observation.R);
        }
        LaneOutcomes<double> outcomes;
        shuffled.update(g, phases, i, moved.frames[static_cast<std::size_t>(i)].X_CW, kDistorted, measured, {},
                        outcomes);
      }
    }
  };
  std::thread other(work, 1);
  work(0);
  other.join();
  for (std::size_t f = 0; f < from.size(); ++f) {
    expect_identical(estimate_of(shuffled, static_cast<int>(f)), estimate_of(straight, from[f]));
  }
}

TEST_P(Bank, MotionFollowsPendingUpdatesWithoutAnotherSweep) {
  const Group group(kLanes, 2, 45);
  FeatureBank<double> bank = this->bank(group.layout, kLanes);
  fill(bank, group);
  const double rate = 7.0;
  const double deviation_s = 0.01;
  SweepPhases<double> phases;
  for (const Group::Held& held : group.frames) phases.add_learnt(held.b, Basis());
  for (const double phase : {0.1, 2.0, 4.0}) {
    phases.add_predicted(basis_at(group.layout, phase), basis_rate(group.layout, phase), rate, deviation_s);
  }
  bank.sweep(0, phases);
  const auto expect_motions = [&] {
    for (int k = 0; k < phases.count(); ++k) {
      LaneMotions<double> from_sweep;
      LaneMotions<double> by_pass;
      bank.motion(0, phases, k, from_sweep);
      bank.motion_at(0, phases[k], by_pass);
      EXPECT_EQ(from_sweep.valid, 0xff);
      for (int lane = 0; lane < kLanes; ++lane) {
        const FeatureEstimate estimate = estimate_of(bank, lane);
        Basis b(group.layout.size());
        Basis b_rate(group.layout.size());
        for (int i = 0; i < b.size(); ++i) {
          b(i) = phases[k].b[static_cast<std::size_t>(i)];
          b_rate(i) = phases[k].b_rate[static_cast<std::size_t>(i)];
        }
        const Vector3d velocity = velocity_of(estimate.x, b_rate, phases[k].rate_rad_per_s);
        const Matrix3d S =
            estimate.position_covariance(b) + std::pow(phases[k].deviation_s, 2) * velocity * velocity.transpose();
        for (const LaneMotions<double>& motions : {from_sweep, by_pass}) {
          EXPECT_LT(largest_difference(motions.position_of(lane), position_of(estimate.x, b)), 1e-12);
          EXPECT_LT(largest_difference(motions.velocity_of(lane), velocity), 1e-11);
          EXPECT_LT(largest_difference(motions.covariance_of(lane), S), 1e-12 * S.norm()) << "phase " << k;
        }
      }
    }
  };
  expect_motions();
  for (int i = 0; i < 2; ++i) {
    LaneObservations<double> measured;
    for (int lane = 0; lane < kLanes; ++lane) {
      const Observation observation = group.observation(i, lane);
      measured.set(lane, observation.z, observation.R);
    }
    LaneOutcomes<double> outcomes;
    bank.update(0, phases, i, group.frames[static_cast<std::size_t>(i)].X_CW, kDistorted, measured, {}, outcomes);
    EXPECT_NE(outcomes.accepted, 0);
    expect_motions();
  }
}

// Position and velocity are those of the phase asked for, the covariance that of the phase it is near: off by no more
// than 2 |B| |P| |dB/dphi| times the distance, to first order.
TEST_P(Bank, MotionNearAPhaseIsTheExactMotionWithTheCovarianceOfThePhase) {
  const Group group(kLanes, 1, 52);
  FeatureBank<double> bank = this->bank(group.layout, kLanes);
  fill(bank, group);
  const double rate = 7.0;
  const double phase = 2.0;
  const auto sweep_phase = [&](double at_rad) {
    SweepPhase<double> at;
    at.set(basis_at(group.layout, at_rad), basis_rate(group.layout, at_rad), rate, 0.0);
    return at;
  };
  SweepPhases<double> phases;
  phases.add_learnt(group.frames[0].b, Basis());
  const int k = phases.add_predicted(basis_at(group.layout, phase), basis_rate(group.layout, phase), rate, 0.0);
  bank.sweep(0, phases);
  const auto near = [&](double at_rad) {
    LaneMotions<double> motions;
    bank.motion_near(0, phases, k, sweep_phase(at_rad), motions);
    EXPECT_EQ(motions.valid, 0xff);
    return motions;
  };
  const auto expect_motions = [&] {
    LaneMotions<double> at_phase;
    bank.motion(0, phases, k, at_phase);
    for (int lane = 0; lane < kLanes; ++lane) {
      const FeatureEstimate estimate = estimate_of(bank, lane);
      const Matrix3d S = estimate.position_covariance(basis_at(group.layout, phase));
      double last_error = 0.0;
      for (const double distance : {0.0, 0.04, 0.02, 0.01}) {
        const double at_rad = phase + distance;
        const Basis b = basis_at(group.layout, at_rad);
        const Basis b_rate = basis_rate(group.layout, at_rad);
        const LaneMotions<double> motions = near(at_rad);
        EXPECT_LT(largest_difference(motions.position_of(lane), position_of(estimate.x, b)), 1e-12);
        EXPECT_LT(largest_difference(motions.velocity_of(lane), velocity_of(estimate.x, b_rate, rate)), 1e-11);
        EXPECT_EQ(motions.covariance_of(lane), at_phase.covariance_of(lane));
        EXPECT_LT(largest_difference(motions.covariance_of(lane), S), 1e-12 * S.norm());
        const double error = (estimate.position_covariance(b) - motions.covariance_of(lane)).norm();
        const double bound = 2.0 * b.norm() * b_rate.norm() * estimate.P.norm() * distance;
        EXPECT_LE(error, 1.1 * bound + 1e-12 * S.norm());
        if (last_error > 0.0) {
          EXPECT_NEAR(error / last_error, 0.5, 0.1);
        }
        if (distance > 0.0) last_error = error;
        constexpr double kStep_rad = 1e-4;
        const Vector3d slope =
            (near(at_rad + kStep_rad).position_of(lane) - near(at_rad - kStep_rad).position_of(lane)) /
            (2.0 * kStep_rad);
        // The central difference is off by a sixth of the third derivative times the step squared.
        EXPECT_LT((motions.velocity_of(lane) - rate * slope).norm(), 1e-5);
      }
    }
  };
  expect_motions();
  LaneObservations<double> measured;
  for (int lane = 0; lane < kLanes; ++lane) {
    const Observation observation = group.observation(0, lane);
    measured.set(lane, observation.z, observation.R);
  }
  LaneOutcomes<double> outcomes;
  bank.update(0, phases, 0, group.frames[0].X_CW, kDistorted, measured, {}, outcomes);
  EXPECT_NE(outcomes.accepted, 0);
  expect_motions();
}

TEST_P(Bank, PredictsTheSameWithAndWithoutASweep) {
  const Group group(2 * kLanes, 1, 46);
  FeatureBank<double> bank = this->bank(group.layout, 2 * kLanes);
  fill(bank, group);
  SweepPhases<double> phases;
  phases.add_predicted(basis_at(group.layout, 1.0), basis_rate(group.layout, 1.0), 7.0, 0.0);
  for (int g = 0; g < bank.groups(); ++g) {
    bank.sweep(g, phases);
    LaneMotions<double> from_sweep;
    bank.motion(g, phases, 0, from_sweep);
    LaneMotions<double> without;
    bank.motion_at(g, phases[0], without);
    for (int lane = 0; lane < kLanes; ++lane) {
      EXPECT_EQ(without.position_of(lane), from_sweep.position_of(lane));
      EXPECT_EQ(without.covariance_of(lane), from_sweep.covariance_of(lane));
    }
  }
}

TEST_P(Bank, AFeatureTakesPartFromTheSweepAfterItIsSet) {
  const Group group(kLanes, 1, 47);
  FeatureBank<double> bank = this->bank(group.layout, kLanes);
  fill(bank, group);
  bank.clear(4);
  EXPECT_FALSE(bank.occupied(4));
  learn_in_one_sweep(bank, group, [](int, int feature) { return feature != 4; });
  // Set while updates are pending, and again after a life of another feature.
  bank.set(4, group.estimates[4]);
  bank.set(5, group.estimates[5]);
  SweepPhases<double> phases;
  phases.add_learnt(group.frames[0].b, Basis());
  LaneObservations<double> measured;
  const Observation observation = group.observation(0, 4);
  measured.set(4, observation.z, observation.R);
  LaneOutcomes<double> outcomes;
  bank.update(0, phases, 0, observation.X_CW, kDistorted, measured, {}, outcomes);
  EXPECT_EQ(outcomes.considered, 0);
  bank.sweep(0, phases);
  expect_identical(estimate_of(bank, 4), group.estimates[4]);
  expect_identical(estimate_of(bank, 5), group.estimates[5]);
  bank.update(0, phases, 0, observation.X_CW, kDistorted, measured, {}, outcomes);
  EXPECT_EQ(outcomes.considered, 1 << 4);
}

TEST_P(Bank, DiffusionChangesItsLaneAlone) {
  const Group group(kLanes, 1, 48);
  FeatureBank<double> bank = this->bank(group.layout, kLanes);
  fill(bank, group);
  learn_in_one_sweep(bank, group, [](int, int) { return true; });
  std::vector<FeatureEstimate> expected;
  for (int f = 0; f < kLanes; ++f) expected.push_back(estimate_of(bank, f));
  bank.diffuse(6, 0.3);
  bank.diffuse(6, 0.4);
  diffuse(expected[6], group.layout, 0.5);
  for (const bool swept : {false, true}) {
    if (swept) bank.sweep(0, SweepPhases<double>{});
    for (int f = 0; f < kLanes; ++f) expect_close(estimate_of(bank, f), expected[static_cast<std::size_t>(f)], 1e-14);
  }
}

TEST_P(Bank, GivesTheCoefficientsAlone) {
  const Group group(kLanes, 1, 50);
  FeatureBank<double> bank = this->bank(group.layout, kLanes);
  fill(bank, group);
  learn_in_one_sweep(bank, group, [](int, int) { return true; });
  StateVector x;
  for (int f = 0; f < kLanes; ++f) {
    bank.get(f, x);
    EXPECT_EQ(x, estimate_of(bank, f).x);
  }
}

TEST_P(Bank, RefusesMoreUpdatesThanItCanHold) {
  const Group group(1, 1, 49);
  FeatureBank<double> bank = this->bank(group.layout, 1);
  fill(bank, group);
  SweepPhases<double> phases;
  phases.add_learnt(group.frames[0].b, Basis());
  bank.sweep(0, phases);
  const Observation observation = group.observation(0, 0);
  LaneObservations<double> measured;
  measured.set(0, observation.z, observation.R);
  for (int i = 0; i <= kMaxPendingUpdates; ++i) {
    LaneOutcomes<double> outcomes;
    bank.update(0, phases, 0, observation.X_CW, kDistorted, measured, {}, outcomes);
    EXPECT_EQ(outcomes.considered, i < kMaxPendingUpdates ? 1 : 0);
  }
}

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

TEST_P(Bank, SinglePrecisionKeepsPositionsToMicrometres) {
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
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kShortRun = 500;
constexpr int kMillionRun = 500;
#else
constexpr int kShortRun = 2'000;
constexpr int kMillionRun = 62'500;  // of each of 16 features
#endif

// 10^6 updates in all on the best path; a short run on the others.
TEST_P(Bank, CovarianceStaysPositiveDefiniteOverAMillionUpdates) {
  const double least = least_eigenvalue_over(bank<double>(kShipped, 2 * kLanes),
                                             GetParam() == best_simd_target() ? kMillionRun : kShortRun);
  std::cout << "least eigenvalue of the correlations: " << least << std::endl;
  EXPECT_GT(least, 1e-9);
}

TEST_P(Bank, CovarianceStaysPositiveDefiniteInSinglePrecision) {
  const double least = least_eigenvalue_over(bank<float>(kShipped, 2 * kLanes),
                                             GetParam() == best_simd_target() ? kMillionRun : kShortRun);
  std::cout << "least eigenvalue of the correlations: " << least << std::endl;
  EXPECT_GT(least, 0.0);
}

TEST_P(Bank, CovarianceStaysPositiveDefiniteWithFewHarmonics) {
  EXPECT_GT(least_eigenvalue_over(bank<double>({1, 0}, 2 * kLanes), kShortRun), 1e-9);
}

}  // namespace
}  // namespace perimap

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

#include "bank_estimates.hpp"
#include "bank_on_target.hpp"
#include "simulated_feature.hpp"

namespace perimap {
namespace {

using test::correlated;
using test::estimate_of;
using test::expect_close;
using test::expect_identical;
using test::kDistorted;
using test::largest_difference;

class Bank : public test::OnEveryTarget {};
INSTANTIATE_TEST_SUITE_P(Simd, Bank, testing::ValuesIn(simd_targets()), test::target_name);

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

}  // namespace
}  // namespace perimap

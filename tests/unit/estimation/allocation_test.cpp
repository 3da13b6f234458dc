// The recursive path takes nothing from the heap. A program of its own, because it counts the calls of the allocator.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/estimation/correlated_pose_noise.hpp"
#include "core/estimation/innovation_monitor.hpp"
#include "core/estimation/iterated_update.hpp"
#include "core/estimation/shared_pose.hpp"
#include "counted_allocations.hpp"

namespace perimap {
namespace {

using test::allocations_of;

template <class Model>
void expect_no_allocation(const Model& model, const Vector3d& ahead_C) {
  for (const BasisLayout layout : {BasisLayout{8, 0}, BasisLayout{kMaxHarmonics, kMaxRespiratoryHarmonics}}) {
    FeatureEstimate estimate = prior_estimate(layout, Prior{}, ahead_C);
    InnovationMonitor monitor;
    Observation observation;
    observation.R = 1e-4 * Matrix2d::Identity();
    int accepted = 0;
    double deviation = 0.0;
    Vector3d v = Vector3d::Zero();
    const long count = allocations_of([&] {
      for (int k = 0; k < 20; ++k) {
        observation.b = basis_at(layout, 0.3 * k, 0.1 * k);
        observation.X_CW.t = Vector3d(0.1 * k, 0.2 * k, 0.0);
        (void)model.predict(observation.X_CW * estimate.position(observation.b), observation.z);
        observation.z.x() += k == 7 ? 1e6 : 1e-3;
        const UpdateOutcome outcome = iterated_update(estimate, observation, model);
        accepted += outcome.accepted ? 1 : 0;
        monitor.add(outcome.normalised_innovation_squared);
        deviation += largest_deviation_mm(estimate, layout, 4);
        v += velocity_of(estimate.x, basis_rate(layout, 0.3 * k), 7.0);
      }
    });
    EXPECT_EQ(count, 0);
    EXPECT_GE(accepted, 18);
    EXPECT_GT(deviation, 0.0);
    EXPECT_TRUE(v.allFinite());
  }
}

TEST(Allocation, PixelUpdatesTakeNothingFromTheHeap) {
  const PixelModel model{CameraModel{
      .width = 640, .height = 480, .fx = 520.0, .fy = 525.0, .cx = 310.0, .cy = 250.0, .k1 = -0.3, .k2 = 0.1}};
  expect_no_allocation(model, Vector3d(5, -3, 80));
}

TEST(Allocation, BearingUpdatesTakeNothingFromTheHeap) { expect_no_allocation(BearingModel{}, Vector3d(80, -3, 5)); }

TEST(Allocation, TheSharedPoseTakesNothingFromTheHeap) {
  const BearingModel model;
  std::array<CommonMatch, 20> matches;
  std::array<std::uint8_t, 20> used{};
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const auto i = static_cast<double>(k);
    matches[k].p_WF = Vector3d(80.0, 20.0 * std::sin(i), 15.0 * std::cos(2.0 * i));
    matches[k].S = 0.1 * Matrix3d::Identity();
    matches[k].R = 1e-5 * Matrix2d::Identity();
    matches[k].D = Vector3d(1.0, i, 2.0);
    EXPECT_EQ(model.predict(matches[k].p_WF, matches[k].z), ProjectionStatus::kOk);
  }
  const BasisLayout layout{kMaxHarmonics, kMaxRespiratoryHarmonics};
  const FeatureEstimate estimate = prior_estimate(layout, Prior{}, Vector3d::Zero());
  CorrelatedPoseNoise noise(layout.state_size(), 5.0);
  StateMatrix larger;
  bool ok = true;
  const long count = allocations_of([&] {
    const CommonInformation prior =
        with_appended(tracker_prior(1e-4 * Matrix3d::Identity(), Matrix3d::Identity()), 1e-4);
    const SharedPose shared =
        estimate_shared_pose(model, Pose{}, prior, std::span<const CommonMatch>(matches), std::span(used));
    ok = shared.estimate.ok;
    for (const CommonMatch& match : matches) ok = ok && what_others_say(model, shared, Pose{}, match).ok;
    for (int f = 0; f < 3; ++f) {
      PoseNoiseTerm term{basis_at(layout, f, f), {}, Matrix23d::Ones(), Matrix2d::Identity(), Matrix26d::Ones(),
                         Matrix6d::Identity()};
      term.M = position_gain(estimate.P, term.b);
      noise.pass(0.5);
      noise.add_of_batch(term);
      noise.add(term);
    }
    larger = estimate.P + noise.covariance();
  });
  EXPECT_EQ(count, 0);
  EXPECT_TRUE(ok);
  EXPECT_TRUE(larger.allFinite());
}

}  // namespace
}  // namespace perimap

// The bank, once made, takes nothing from the heap. A program of its own, because it counts the calls of the allocator.
#include <gtest/gtest.h>

#include "core/bank/feature_bank.hpp"
#include "counted_allocations.hpp"

namespace perimap {
namespace {

using test::allocations_of;

template <class Real, class Model>
void expect_no_allocation(const Model& model, const Vector3d& ahead_C) {
  const BasisLayout layout{8, 1};
  FeatureBank<Real> bank({.layout = layout, .features = 3 * kLanes});
  LaneMotions<Real> motions;
  const FeatureEstimate start = prior_estimate(layout, Prior{.dc_mm = 1.0}, ahead_C);
  FeatureEstimate estimate;
  int accepted = 0;
  const long count = allocations_of([&] {
    for (int f = 0; f < bank.features(); ++f) bank.set(f, start);
    for (int k = 0; k < 10; ++k) {
      SweepPhases<Real> phases;
      phases.add_learnt(basis_at(layout, 0.3 * k, 0.1 * k), basis_rate(layout, 0.3 * k), 7.0, 0.01);
      phases.add_predicted(basis_at(layout, 0.5 * k), basis_rate(layout, 0.5 * k), 7.0, 0.01);
      Vector2d z;
      (void)model.predict(ahead_C, z);
      for (int g = 0; g < bank.groups(); ++g) {
        bank.sweep(g, phases);
        bank.motion(g, phases, 0, motions);
        LaneObservations<Real> measured;
        for (int lane = 0; lane < kLanes; ++lane) measured.set(lane, z, 1e-2 * Matrix2d::Identity());
        LaneOutcomes<Real> outcomes;
        bank.update(g, phases, 0, Pose{}, model, measured, UpdateSettings{}, outcomes);
        accepted += outcomes.accepted != 0 ? 1 : 0;
        bank.motion_at(g, phases[1], motions);
      }
      bank.get(k, estimate);
      bank.get(k, estimate.x);
      bank.diffuse(k, 0.1);
      bank.clear(k + 10);
    }
  });
  EXPECT_EQ(count, 0);
  EXPECT_EQ(accepted, 10 * bank.groups());
}

TEST(Allocation, TheBankTakesNothingFromTheHeap) {
  const PixelModel model{CameraModel{
      .width = 640, .height = 480, .fx = 520.0, .fy = 525.0, .cx = 310.0, .cy = 250.0, .k1 = -0.3, .k2 = 0.1}};
  expect_no_allocation<double>(model, Vector3d(5, -3, 80));
  expect_no_allocation<float>(model, Vector3d(5, -3, 80));
  expect_no_allocation<double>(BearingModel{}, Vector3d(80, -3, 5));
}

}  // namespace
}  // namespace perimap

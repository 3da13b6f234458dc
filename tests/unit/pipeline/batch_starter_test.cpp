#include "core/pipeline/batch_starter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <thread>
#include <vector>

#include "core/pipeline/pose_noise.hpp"

namespace perimap {
namespace {

constexpr double kPoseDeviation_mm = 0.2;
constexpr double kPixelDeviation_px = 0.3;

// A camera that looks along z and goes to and fro sideways; 100 mm before it a feature that beats up and down by 4 mm,
// seen without error for 3 s.
struct Start : ::testing::Test {
  PipelineSettings settings;
  std::vector<FeatureSlot> slots{1};
  FeatureSlot& slot = slots.front();

  Start() {
    settings.camera = {640, 480, 500, 500, 320, 240, 0, 0, 0, 0, 0};
    settings.estimator.layout.cardiac_harmonics = 2;
    settings.workers = 1;
  }

  void see(double phase_deviation_s) {
    constexpr double kRate_rad_per_s = 2.0 * std::numbers::pi / 0.8;
    const BasisLayout& layout = settings.estimator.layout;
    slot.start.count = kMaxStartObservations;
    for (int i = 0; i < slot.start.count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const double t_s = i / 30.0;
      CameraPose& pose = slot.start.poses[k];
      pose.state = CameraPose::State::kInterpolated;
      pose.position_variance_mm2 = kPoseDeviation_mm * kPoseDeviation_mm;
      pose.X_WC.t.x() = 20.0 * std::sin(2.0 * t_s);
      slot.start.captures[k] = Instant(std::chrono::milliseconds(33 * i));
      Observation& o = slot.start.observations[k];
      o.X_CW = pose.X_WC.inverse();
      o.b = basis_at(layout, kRate_rad_per_s * t_s);
      o.b_deviation = basis_rate(layout, kRate_rad_per_s * t_s) * (kRate_rad_per_s * phase_deviation_s);
      const Vector3d p_C = o.X_CW * Vector3d(0.0, 4.0 * std::cos(kRate_rad_per_s * t_s), 100.0);
      Matrix23d J_C;
      ASSERT_EQ(settings.camera.project(p_C, o.z, &J_C), ProjectionStatus::kOk);
      o.R = kPixelDeviation_px * kPixelDeviation_px * Matrix2d::Identity() +
            pose_noise_covariance(pose, pose.X_WC * p_C, J_C * o.X_CW.R);
    }
  }

  void solve() {
    SurfaceMaker surfaces(settings.estimator.layout, slots.size(), 100, true);
    BatchStarter starter(settings, slots, surfaces);
    std::thread housekeeping([&] { starter.serve(); });
    starter.request(0, 0);
    starter.wait_until_done();
    starter.dismiss();
    housekeeping.join();
    ASSERT_TRUE(slot.start.outcome.ok());
  }
};

// An offset of the pose that never changes moves the whole path by as much, however the observations are weighed, as
// long as what they have in common is counted with the weights that they had.
TEST_F(Start, WithUncertainPhasesIsAsUncertainByAPoseErrorThatStaysAsThePoseItself) {
  slot.slow_error = std::make_unique<CorrelatedPoseNoise>(3 * settings.estimator.layout.size(), 1e6);
  see(0.03);
  solve();
  constexpr double kPoseVariance_mm2 = kPoseDeviation_mm * kPoseDeviation_mm;
  for (int i = 0; i < 8; ++i) {
    const Basis b = basis_at(settings.estimator.layout, i * std::numbers::pi / 4.0);
    EXPECT_NEAR(slot.slow_error->position_covariance(b)(1, 1), kPoseVariance_mm2, 0.15 * kPoseVariance_mm2);
  }
}

}  // namespace
}  // namespace perimap

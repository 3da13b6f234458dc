#include "core/pipeline/image_phase.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

namespace perimap {
namespace {

// Sixteen converged features on a plane 100 mm before a still camera at the origin, moving 4 mm sideways and along the
// axis; the frame is supposed at 1 rad, at 7 rad/s.
struct Surface : ::testing::Test {
  static constexpr int kFeatures = 16;
  static constexpr double kPhase = 1.0;
  static constexpr double kRate = 7.0;

  EstimatorSettings settings;
  PixelModel model;
  FrameHistory history{BasisLayout{2, 0}};
  std::vector<FeatureSlot> slots{kFeatures};
  MapBank bank{{.layout = {2, 0}, .features = kFeatures}, Precision::kDouble};
  std::vector<FeatureGroup> groups;
  std::vector<FeatureEstimate> estimates;
  FrameJob job;
  ImagePhase image_phase;
  std::mt19937 generator{3};

  Surface() {
    settings.layout = {2, 0};
    settings.pixel_deviation_px = 0.3;
    model.camera = {640, 480, 500, 500, 320, 240, 0, 0, 0, 0, 0};
    std::uniform_real_distribution<double> place(-35.0, 35.0);
    for (int f = 0; f < kFeatures; ++f) {
      FeatureEstimate estimate =
          prior_estimate(settings.layout, Prior{}, Vector3d(place(generator), place(generator), 100));
      const int n = settings.layout.size();
      estimate.x(1) = 4.0 + 0.02 * f;  // cos, x
      estimate.x(2 * n + 1) = 4.0;     // cos, z
      estimate.x(n + 3) = 1.0;         // sin, y
      estimate.P *= 1e-5;
      estimates.push_back(estimate);
      bank.set(f, estimate);
      FeatureSlot& slot = slots[static_cast<std::size_t>(f)];
      slot.state = SlotState::kMapped;
      slot.converged = true;
    }
    const std::span<FeatureSlot> all(slots);
    for (int g = 0; g < bank.groups(); ++g) {
      groups.emplace_back(bank, g, all.subspan(static_cast<std::size_t>(g) * kLanes, kLanes));
    }
    FrameRecord& frame = history.append({});
    frame.measurable = true;
    frame.pose.state = CameraPose::State::kInterpolated;
    frame.pose.position_variance_mm2 = 0.05 * 0.05;
    frame.pose.rotation_variance_rad2 = 1e-8;
    frame.phase = {kPhase, kRate, 0.02, PhaseState::kLocked, false};
    frame.b = basis_at(settings.layout, kPhase);
    frame.b_rate = basis_rate(settings.layout, kPhase);
    job.frame = &frame;
    job.about_capture = bases_about(settings.layout, frame.phase, frame.respiration);
    job.history = &history;
    job.evaluated_b.fill(frame.b);
    job.plan.end = kReleasesCovered;
    for (FeatureGroup& group : groups) group.sweep(job);
  }

  // The features as they are seen `later_s` after the supposed phase by a camera that stands `moved_mm` aside.
  void see(double later_s, const Vector3d& moved_mm = Vector3d::Zero(), int from = 0, int to = kFeatures) {
    std::normal_distribution<double> noise(0.0, 0.2);
    for (int f = from; f < to; ++f) {
      FeatureSlot& slot = slots[static_cast<std::size_t>(f)];
      const Vector3d p =
          estimates[static_cast<std::size_t>(f)].position(basis_at(settings.layout, kPhase + kRate * later_s));
      Vector2d px;
      ASSERT_EQ(model.camera.project(p - moved_mm, px), ProjectionStatus::kOk);
      slot.match.state = MatchState::kFound;
      slot.match.px = px + Vector2d(noise(generator), noise(generator));
      slot.match.covariance_px2 = 0.04 * Matrix2d::Identity();
    }
  }

  ImagePhaseOutcome observe(ObservedPhase& observed) {
    const ImagePhaseAnswer answer = image_phase.observe(groups, *job.frame, model, settings).cardiac;
    observed = answer.observed;
    return answer.outcome;
  }
};

TEST_F(Surface, ThePhaseIsFoundWhereTheHeartIs) {
  for (const double later_s : {-0.06, -0.01, 0.0, 0.02, 0.06}) {
    see(later_s);
    ObservedPhase observed;
    ASSERT_EQ(observe(observed), ImagePhaseOutcome::kObserved) << later_s;
    const double error_s = (observed.phase_rad - kPhase) / kRate - later_s;
    EXPECT_LT(std::abs(error_s), 4.0 * observed.deviation_rad / kRate) << later_s;
    EXPECT_LT(std::abs(error_s), 0.004) << later_s;
  }
}

TEST_F(Surface, APoseThatIsWrongByAsMuchAsTheTrackerMayBeIsNotTakenForPhase) {
  // Tracker noise of 1.4 mm: the camera may stand so far aside, which in the image is as much as 40 ms of motion.
  FrameRecord frame = *job.frame;
  frame.pose.position_variance_mm2 = 1.4 * 1.4 / 3.0;
  see(0.0, Vector3d(-1.0, 0.4, 0.0));
  ObservedPhase observed;
  const ImagePhaseAnswer answer = image_phase.observe(groups, frame, model, settings).cardiac;
  ASSERT_EQ(answer.outcome, ImagePhaseOutcome::kObserved);
  observed = answer.observed;
  const double error_s = (observed.phase_rad - kPhase) / kRate;
  EXPECT_LT(std::abs(error_s), 4.0 * observed.deviation_rad / kRate);
  EXPECT_GT(observed.deviation_rad / kRate, 0.003) << "motion along the axis is all that tells them apart";
}

TEST_F(Surface, AThirdOfTheMatchesOnAnInstrumentChangesNothing) {
  see(0.02);
  for (std::size_t f = 0; f < 5; ++f) slots[f].match.px += Vector2d(25.0, -40.0);
  ObservedPhase observed;
  ASSERT_EQ(observe(observed), ImagePhaseOutcome::kObserved);
  EXPECT_NEAR((observed.phase_rad - kPhase) / kRate, 0.02, 0.004);
}

TEST_F(Surface, AnOutlierAmongTheFewestMatchesIsNoContradiction) {
  see(0.02, Vector3d::Zero(), 0, ImagePhase::kFewestMatches);
  slots[2].match.px += Vector2d(25.0, -40.0);
  ObservedPhase observed;
  EXPECT_EQ(observe(observed), ImagePhaseOutcome::kCanNotTell);
}

TEST_F(Surface, FewFeaturesSayNothing) {
  see(0.02, Vector3d::Zero(), 0, ImagePhase::kFewestMatches - 1);
  ObservedPhase observed;
  EXPECT_EQ(observe(observed), ImagePhaseOutcome::kCanNotTell);
}

TEST_F(Surface, WhatFeaturesThatAreNotConvergedTellIsTentative) {
  see(0.02);
  for (std::size_t f = 0; f < slots.size() - 3; ++f) slots[f].converged = false;
  ObservedPhase observed;
  EXPECT_EQ(observe(observed), ImagePhaseOutcome::kTentative);
}

TEST_F(Surface, ThatFeaturesWhichAreNotConvergedAgreeOnNothingIsNoContradiction) {
  std::uniform_real_distribution<double> anywhere(-80.0, 80.0);
  see(0.0);
  for (FeatureSlot& slot : slots) {
    slot.converged = false;
    slot.match.px += Vector2d(anywhere(generator), anywhere(generator));
  }
  ObservedPhase observed;
  EXPECT_EQ(observe(observed), ImagePhaseOutcome::kCanNotTell);
}

TEST_F(Surface, MatchesThatAgreeOnNothingContradict) {
  std::uniform_real_distribution<double> anywhere(-80.0, 80.0);
  see(0.0);
  for (FeatureSlot& slot : slots) slot.match.px += Vector2d(anywhere(generator), anywhere(generator));
  ObservedPhase observed;
  EXPECT_EQ(observe(observed), ImagePhaseOutcome::kContradicts);
}

TEST_F(Surface, AHeartThatStandsStillTellsNothing) {
  for (int f = 0; f < kFeatures; ++f) {
    FeatureEstimate& estimate = estimates[static_cast<std::size_t>(f)];
    const int n = settings.layout.size();
    for (int axis = 0; axis < 3; ++axis) estimate.x.segment(axis * n + 1, n - 1).setZero();
    bank.set(f, estimate);
  }
  for (FeatureGroup& group : groups) group.sweep(job);
  see(0.0);
  ObservedPhase observed;
  EXPECT_EQ(observe(observed), ImagePhaseOutcome::kCanNotTell);
}

TEST(PosePrior, IsTheSensorsErrorAtTheCamera) {
  // A sensor 200 mm behind the camera on its axis that turns a little about x moves the camera along y.
  CameraPose pose;
  pose.state = CameraPose::State::kInterpolated;
  pose.lever_W_mm = Vector3d(0, 0, 200);
  pose.position_variance_mm2 = 0.25;
  pose.rotation_variance_rad2 = 1e-4;
  const CommonInformation prior = pose_prior(pose);
  const CommonMatrix covariance = prior.Lambda.inverse();
  EXPECT_NEAR(covariance(0, 0), 1e-4, 1e-9);
  EXPECT_NEAR(covariance(3, 3), 0.25 + 1e-4 * 200 * 200, 1e-6);
  EXPECT_NEAR(covariance(4, 4), 0.25 + 1e-4 * 200 * 200, 1e-6);
  EXPECT_NEAR(covariance(5, 5), 0.25, 1e-6);
  // theta_W = e_x: the camera turns by -e_x in its frame, and its centre moves by e_x x 200 e_z = -200 e_y.
  EXPECT_NEAR(covariance(0, 4), 1e-4 * 200.0, 1e-7);
}

}  // namespace
}  // namespace perimap

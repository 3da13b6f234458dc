#include "core/pipeline/feature_group.hpp"
#include "tests/unit/pipeline/stages.hpp"

namespace perimap {
namespace {

struct Evidence : Stages {
  Evidence() {
    map_feature(0);
    map_feature(1);
  }

  // Sideways, at a fixed phase.
  double variance_mm2(int lane) const {
    FeatureEstimate estimate;
    bank->get(lane, estimate);
    return estimate.position_covariance(basis_at(settings.estimator.layout, 1.0))(0, 0);
  }

  void learn(double drift_px_per_s) {
    const Matrix2d R = match_covariance(0.05 * Matrix2d::Identity(), settings.estimator.pixel_deviation_px);
    std::normal_distribution<double> scatter_px(0.0, std::sqrt(R(0, 0)));
    next_frame();
    drift_px += drift_px_per_s * 0.033;
    found_at({320 + drift_px + scatter_px(generator), 240 + scatter_px(generator)}, 0);
    found_at({320 + scatter_px(generator), 240 + scatter_px(generator)}, 1);
    ASSERT_EQ(learn_frame(), LifeEvent::kNone);
  }

  std::mt19937 generator{5};
  double drift_px = 0.0;
};

TEST_F(Evidence, ThatNothingFitsInflatesTheCovarianceOnce) {
  std::normal_distribution<double> anywhere_px(0.0, 3.0);
  int inflations = 0;
  for (LifeEvent event = LifeEvent::kNone; event == LifeEvent::kNone;) {
    const double before_mm2 = variance_mm2(0);
    next_frame();
    found_at({320 + anywhere_px(generator), 240 + anywhere_px(generator)});
    event = learn_frame();
    ASSERT_LT(job.frame->index, 600U);
    inflations += event == LifeEvent::kNone && variance_mm2(0) > before_mm2 + kInflation_mm * kInflation_mm ? 1 : 0;
  }
  EXPECT_EQ(inflations, 1);
}

TEST_F(Evidence, OfADriftSwitchesProcessNoiseOnSoThatTheFilterFollows) {
  int drifting = 0;
  for (int i = 0; i < 900; ++i) {
    learn(0.3);
    drifting += slots[0].health.state() == HealthState::kDrifting ? 1 : 0;
  }
  EXPECT_GT(drifting, 100);
  EXPECT_GT(slots[0].health.process_noise(), 0.0);
  EXPECT_GT(variance_mm2(0), 2.0 * variance_mm2(1));
}

TEST_F(Evidence, ThatTheEstimateIsRightLeavesProcessNoiseOff) {
  double before_mm2 = variance_mm2(0);
  for (int i = 0; i < 900; ++i) {
    learn(0.0);
    ASSERT_EQ(slots[0].health.process_noise(), 0.0);
    ASSERT_LE(variance_mm2(0), before_mm2);
    before_mm2 = variance_mm2(0);
  }
}

// A feature that moves so fast that errors of the R peaks are most of what its matches are off by.
struct UncertainBeats : Stages {
  UncertainBeats() {
    // Those before the first frame as well.
    clock = CardiacClockTracker({});
    beat_deviation = milliseconds(10);
    next_beat_ms = 1000;
    beat_until(5000);
    estimate = still_feature();
    estimate.x(1) = 12.0;
    slot->state = SlotState::kMapped;
    bank->set(0, estimate);
  }

  // Of 20 features, how many get process noise in half a minute in which they are off by so many deviations.
  int drifting(double deviations) {
    const Matrix2d R = match_covariance(0.05 * Matrix2d::Identity(), settings.estimator.pixel_deviation_px);
    const double scatter_px = deviations * std::sqrt(R(0, 0));
    const double scatter_s = deviations * 0.01;
    int count = 0;
    for (unsigned seed = 0; seed < 20; ++seed) {
      bank->set(0, estimate);
      slot->health.reset();
      std::mt19937 generator(seed);
      std::normal_distribution<double> normal;
      double begin_s = scatter_s * normal(generator);
      double end_s = scatter_s * normal(generator);
      double last_rad = 0.0;
      for (int i = 0; i < 900 && !(slot->health.process_noise() > 0.0); ++i) {
        next_frame();
        const PhaseEstimate& phase = current->phase;
        if (phase.phase_rad < last_rad) begin_s = std::exchange(end_s, scatter_s * normal(generator));
        last_rad = phase.phase_rad;
        const double off_s = std::lerp(begin_s, end_s, phase.phase_rad / (2.0 * std::numbers::pi));
        const double seen_rad = phase.phase_rad + phase.rate_rad_per_s * off_s;
        Vector2d px;
        EXPECT_EQ(model.camera.project(estimate.position(basis_at(settings.estimator.layout, seen_rad)), px),
                  ProjectionStatus::kOk);
        found_at(px + scatter_px * Vector2d(normal(generator), normal(generator)));
        EXPECT_EQ(learn_frame(), LifeEvent::kNone);
      }
      count += slot->health.process_noise() > 0.0 ? 1 : 0;
    }
    return count;
  }

  FeatureEstimate estimate;
};

TEST_F(UncertainBeats, AreNoDrift) { EXPECT_LE(drifting(1.0), 1); }

TEST_F(UncertainBeats, DoNotHideDrift) { EXPECT_GE(drifting(1.3), 15); }

// Sideways variance shown after 300 frames with a pose that is off by 1 mm, and after as many again.
struct SlowPoseError : Stages {
  SlowPoseError() { pose_variance_mm2 = 1.0; }

  double shown_variance_mm2() {
    for (int i = 0; i < 300; ++i) {
      next_frame();
      found_at({320, 240});
      EXPECT_EQ(learn_frame(), LifeEvent::kNone);
    }
    next_frame();
    return shown().at(0).covariances_W_mm2[0](0, 0);
  }
};

TEST_F(SlowPoseError, StaysInWhatIsShown) {
  for (FeatureSlot& s : slots) s.slow_error = std::make_unique<CorrelatedPoseNoise>(bank->layout().state_size(), 1e4);
  FeatureEstimate estimate = still_feature();
  estimate.P *= 1e4;
  map_feature();
  bank->set(0, estimate);
  EXPECT_NEAR(shown_variance_mm2(), 1.0, 0.1);
  EXPECT_NEAR(shown_variance_mm2(), 1.0, 0.1);
}

TEST_F(SlowPoseError, AveragesOutWhereItIsTakenForWhite) {
  map_feature();
  EXPECT_LT(shown_variance_mm2(), 0.05);
}

TEST_F(SlowPoseError, OfTheBatchStartIsCountedToo) {
  slot->slow_error = std::make_unique<CorrelatedPoseNoise>(bank->layout().state_size(), 1e4);
  slot->state = SlotState::kTracked;
  std::mt19937 generator(3);
  std::normal_distribution<double> normal(0.0, 0.3);
  settings.workers = 1;
  SurfaceMaker surfaces(settings.estimator.layout, slots.size(), 100, true);
  BatchStarter starter(settings, slots, surfaces);
  std::thread housekeeping([&] { starter.serve(); });
  for (int i = 0; slot->state != SlotState::kMapped && i < 200; ++i) {
    next_frame();
    // The camera moves, so that there is a depth.
    FrameRecord& frame = *current;
    frame.pose.X_WC.t.x() = 20.0 * std::sin(0.1 * i);
    frame.X_CW = frame.pose.X_WC.inverse();
    const Vector3d q = frame.X_CW * Vector3d(0.0, 0.0, 100.0);
    found_at({320 + 500 * q.x() / q.z() + normal(generator), 240 + normal(generator)});
    if (learn_frame() == LifeEvent::kStartRequested) {
      starter.request(0, 0);
      starter.wait_until_done();
      slot->start.due = slot->start.ready.load();
    }
  }
  starter.dismiss();
  housekeeping.join();
  ASSERT_EQ(slot->state, SlotState::kMapped);
  next_frame();
  FeatureEstimate estimate;
  bank->get(0, estimate);
  EXPECT_LT(estimate.position_covariance(job.evaluated_b[0])(1, 1), 0.2) << "what the recursion believes";
  EXPECT_GT(shown().at(0).covariances_W_mm2[0](1, 1), 0.8);
}

}  // namespace
}  // namespace perimap

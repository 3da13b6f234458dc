#include "core/pipeline/feature_stages.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <random>

namespace perimap {
namespace {

using std::chrono::milliseconds;

// A still camera at the origin looking along z, beats every 800 ms, frames every 33 ms from 5 s on.
struct Stages : ::testing::Test {
  PipelineSettings settings;
  PixelModel model;
  CardiacClockTracker clock{{}};
  std::unique_ptr<FrameHistory> history;
  std::unique_ptr<FeatureSlot> slot = std::make_unique<FeatureSlot>();
  FrameJob job;
  int next_beat_ms = 1000;

  Stages() {
    settings.camera = {640, 480, 500, 500, 320, 240, 0, 0, 0, 0, 0};
    settings.estimator.layout.cardiac_harmonics = 2;
    model.camera = settings.camera;
    history = std::make_unique<FrameHistory>(settings.estimator.layout);
    beat_until(5000);
    slot->id = 1;
  }

  void beat_until(int ms) {
    for (; next_beat_ms <= ms; next_beat_ms += 800) {
      const Instant t(milliseconds{next_beat_ms});
      clock.on_r_peak({t, t + milliseconds(60), 1.0, milliseconds(1)});
    }
  }

  void next_frame() {
    const auto n = static_cast<int>(history->count());
    const Instant capture(milliseconds(5000 + 33 * n));
    FrameRecord& frame = history->append({static_cast<std::uint64_t>(n), capture, capture + milliseconds(12)});
    frame.pose.state = CameraPose::State::kInterpolated;
    history->set_phase(frame, clock.clock());
    job.frame = &frame;
    job.history = history.get();
    slot->match = PatchMatch{};
  }

  void found_at(const Vector2d& px) {
    slot->match.state = MatchState::kFound;
    slot->match.px = px;
    slot->match.covariance_px2 = 0.05 * Matrix2d::Identity();
    slot->last_found_frame = job.frame->index;
    hold_match(*slot, job);
  }

  LearnOutcome learn_frame() { return learn(*slot, job, model, settings); }

  // A mapped feature at (0, 0, 100) mm, seen at the image centre, with little deviation.
  void map_feature() {
    slot->state = SlotState::kMapped;
    slot->estimate = prior_estimate(settings.estimator.layout, settings.estimator.prior, Vector3d(0, 0, 100));
    slot->estimate.P *= 1e-4;
  }
};

TEST_F(Stages, ATrackedFeatureWithoutMatchesIsGivenUpSoon) {
  slot->state = SlotState::kTracked;
  next_frame();
  found_at({320, 240});
  int frames = 0;
  while (learn_frame() != LearnOutcome::kLost) {
    next_frame();
    ASSERT_LT(++frames, 10);
  }
  EXPECT_EQ(slot->state, SlotState::kEmpty);
}

TEST_F(Stages, AMappedFeatureThatNoMotionExplainsIsStartedAnewUnderItsId) {
  map_feature();
  std::mt19937 generator(1);
  std::normal_distribution<double> normal(0.0, 3.0);
  int frames = 0;
  int inconsistent = 0;
  LearnOutcome outcome = LearnOutcome::kNothing;
  while (outcome == LearnOutcome::kNothing) {
    beat_until(5000 + 33 * static_cast<int>(history->count()));
    next_frame();
    found_at({320 + normal(generator), 240 + normal(generator)});
    outcome = learn_frame();
    inconsistent += slot->health.state() == HealthState::kInconsistent ? 1 : 0;
    ASSERT_LT(++frames, 600);
  }
  EXPECT_EQ(outcome, LearnOutcome::kStartedAnew);
  EXPECT_GT(inconsistent, 100) << "said so before";
  EXPECT_EQ(slot->state, SlotState::kTracked);
  EXPECT_EQ(slot->id, 1U);
  EXPECT_EQ(slot->held.size(), 0U);
}

TEST_F(Stages, ATrackedFeatureAsksForItsStartOnceItHasEnoughMatches) {
  slot->state = SlotState::kTracked;
  int frames = 0;
  LearnOutcome outcome = LearnOutcome::kNothing;
  while (outcome == LearnOutcome::kNothing) {
    beat_until(5000 + 33 * static_cast<int>(history->count()));
    next_frame();
    found_at({320, 240});
    outcome = learn_frame();
    ++frames;
  }
  EXPECT_EQ(outcome, LearnOutcome::kStartRequested);
  EXPECT_EQ(frames, settings.estimator.start_observations);
  EXPECT_EQ(slot->start.count, settings.estimator.start_observations);
  EXPECT_EQ(slot->start.adopt_at_frame, job.frame->index + static_cast<std::uint64_t>(settings.adoption_delay_frames));
}

TEST_F(Stages, AnAdoptedFeatureWasLastObservedWhenItsStartsLastMatchWas) {
  slot->state = SlotState::kTracked;
  LearnOutcome outcome = LearnOutcome::kNothing;
  while (outcome == LearnOutcome::kNothing) {
    beat_until(5000 + 33 * static_cast<int>(history->count()));
    next_frame();
    found_at({320, 240});
    outcome = learn_frame();
  }
  const Instant last = job.frame->stamp.capture;
  slot->start.outcome.status = BatchStatus::kOk;
  slot->start.outcome.estimate =
      prior_estimate(settings.estimator.layout, settings.estimator.prior, Vector3d(0, 0, 100));
  slot->start.ready.store(true);
  while (slot->state == SlotState::kStarting) {
    next_frame();
    ASSERT_EQ(learn_frame(), LearnOutcome::kNothing);
  }
  EXPECT_EQ(slot->state, SlotState::kMapped);
  EXPECT_EQ(job.frame->index, slot->start.adopt_at_frame);
  EXPECT_EQ(slot->last_observed, last);
}

TEST_F(Stages, ALateStartIsToldOnceAndAdoptedWhenItComes) {
  slot->state = SlotState::kStarting;
  slot->start.adopt_at_frame = 0;
  slot->start.count = 0;
  slot->start.outcome.status = BatchStatus::kDiverged;
  next_frame();
  EXPECT_EQ(learn_frame(), LearnOutcome::kAdoptionLate);
  next_frame();
  EXPECT_EQ(learn_frame(), LearnOutcome::kNothing);
  slot->start.ready.store(true);
  next_frame();
  EXPECT_EQ(learn_frame(), LearnOutcome::kNothing);
  EXPECT_EQ(slot->state, SlotState::kTracked) << "a failed start tries again";
}

TEST_F(Stages, AMatchThatFitsIsLearntAndOneThatDoesNotIsRefused) {
  map_feature();
  next_frame();
  found_at({320.3, 240.0});
  ASSERT_EQ(learn_frame(), LearnOutcome::kNothing);
  EXPECT_EQ(slot->updates, 1);
  EXPECT_EQ(slot->last_observed, job.frame->stamp.capture);
  next_frame();
  found_at({360.0, 240.0});
  ASSERT_EQ(learn_frame(), LearnOutcome::kNothing);
  EXPECT_EQ(slot->updates, 1);
  EXPECT_EQ(slot->refused_in_a_row, 1);
}

TEST_F(Stages, AMatchWhoseFrameLostItsPhaseIsNotLearnt) {
  map_feature();
  next_frame();
  found_at({320, 240});
  // No beat for ten seconds, then beats again: the frame lay in a gap that was no cycle.
  next_beat_ms = 15'000;
  beat_until(18'000);
  history->refresh_phases(clock.clock());
  ASSERT_FALSE(job.frame->measurable);
  ASSERT_EQ(learn_frame(), LearnOutcome::kNothing);
  EXPECT_EQ(slot->updates, 0);
  EXPECT_EQ(slot->held.size(), 0U);
}

TEST_F(Stages, AFeatureRefusedTenTimesLetsGoOfItsPatchAndIsStillGivenUpWhenUnseen) {
  map_feature();
  for (int i = 0; i < 10; ++i) {
    beat_until(5000 + 33 * static_cast<int>(history->count()));
    next_frame();
    found_at({420.0, 240.0});
    ASSERT_EQ(learn_frame(), LearnOutcome::kNothing);
  }
  EXPECT_LT(slot->last_found_frame + 5, job.frame->index) << "the next search starts where the map says";
  int frames = 0;
  do {
    next_frame();
    ASSERT_LT(++frames, 1000);
  } while (learn_frame() != LearnOutcome::kLost);
  EXPECT_EQ(slot->state, SlotState::kEmpty);
}

TEST_F(Stages, NothingIsShownOfAFeatureBeforeItsStart) {
  FeatureSnapshot snapshot;
  next_frame();
  for (const SlotState state : {SlotState::kEmpty, SlotState::kTracked, SlotState::kStarting}) {
    slot->state = state;
    EXPECT_FALSE(evaluate(*slot, job, snapshot));
  }
}

TEST_F(Stages, AMappedFeatureThatIsNotMatchedSaysSo) {
  map_feature();
  slot->converged = true;
  next_frame();
  for (ReleaseBasis& release : job.releases) release.b = basis_at(settings.estimator.layout, 1.0);
  FeatureSnapshot snapshot;
  ASSERT_TRUE(evaluate(*slot, job, snapshot));
  EXPECT_EQ(snapshot.state, FeatureState::kConverged);
  EXPECT_EQ(snapshot.reason, FeatureReason::kNotObserved);
  found_at({320, 240});
  ASSERT_TRUE(evaluate(*slot, job, snapshot));
  EXPECT_EQ(snapshot.reason, FeatureReason::kNone);
}

}  // namespace
}  // namespace perimap

#include "core/pipeline/feature_group.hpp"

#include "tests/unit/pipeline/stages.hpp"

namespace perimap {
namespace {

TEST_F(Stages, AMatchThatFitsIsLearntAndOneThatDoesNotIsRefused) {
  map_feature();
  next_frame();
  found_at({320.3, 240.0});
  EXPECT_EQ(slot->last_observed, job.frame->stamp.capture);
  next_frame();
  found_at({360.0, 240.0});
  ASSERT_EQ(learn_frame(), LifeEvent::kNone);
  EXPECT_EQ(slot->updates, 1);
  next_frame();
  ASSERT_EQ(learn_frame(), LifeEvent::kNone);
  EXPECT_EQ(slot->updates, 1);
  EXPECT_EQ(slot->refused_in_a_row, 1U);
}

TEST_F(Stages, LearningWaitsForTheEndOfTheCycleAndIsSpreadOverFrames) {
  beats_known_ahead_ms = -90;  // the detector's delay
  map_feature();
  int learnt_at_most = 0;
  int waiting_at_most = 0;
  for (int i = 0; i < 100; ++i) {
    next_frame();
    EXPECT_TRUE(group->prediction(0).valid);
    found_at({320, 240});
    const int before = slot->updates;
    ASSERT_EQ(learn_frame(), LifeEvent::kNone);
    learnt_at_most = std::max(learnt_at_most, slot->updates - before);
    waiting_at_most = std::max(waiting_at_most, static_cast<int>(slot->held.size()));
    const Instant cycle_began = clock.clock().anchor();
    if (slot->held.size() > 0 && history->find(slot->held[0].frame_index)->stamp.capture >= cycle_began) {
      EXPECT_EQ(slot->updates + static_cast<int>(slot->held.size()), i + 1) << "nothing is lost";
    }
  }
  EXPECT_EQ(learnt_at_most, kLearnPerFrame);
  EXPECT_GT(slot->updates, 60);
  EXPECT_LT(waiting_at_most, 50) << "a cycle and what arrives while it drains";
}

TEST_F(Stages, AMatchWhoseFrameLostItsPhaseIsNotLearnt) {
  beats_known_ahead_ms = -10'000;
  map_feature();
  next_frame();
  found_at({320, 240});
  ASSERT_EQ(learn_frame(), LifeEvent::kNone);
  const FrameRecord* lost = job.frame;
  // No beat for ten seconds, then beats again: the frame lay in a gap that was no cycle.
  next_beat_ms = 15'000;
  beat_until(18'000);
  history->refresh_phases(clock.clock(), RespiratoryClock{});
  ASSERT_FALSE(lost->measurable);
  next_frame();
  ASSERT_EQ(learn_frame(), LifeEvent::kNone);
  EXPECT_EQ(slot->updates, 0);
  EXPECT_EQ(slot->held.size(), 0U);
}

TEST_F(Stages, WhatWasPutOffIsLearntLaterInOrderAndGivesTheSameEstimate) {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal(0.0, 0.2);
  std::vector<Vector2d> places(12);
  for (Vector2d& px : places) px = {320 + normal(generator), 240 + normal(generator)};
  const auto learnt_when = [&](auto put_off) {
    history = std::make_unique<FrameHistory>(settings.estimator.layout);
    slot->updates = 0;
    slot->last_learnt = {};
    slot->health.reset();
    map_feature();
    for (std::size_t i = 0; i < places.size(); ++i) {
      next_frame();
      found_at(places[i]);
      if (put_off(i)) continue;
      EXPECT_EQ(learn_frame(), LifeEvent::kNone);
    }
    for (int i = 0; i < 3; ++i) {
      next_frame();
      EXPECT_EQ(learn_frame(), LifeEvent::kNone);
    }
    EXPECT_EQ(slot->held.size(), 0U);
    EXPECT_EQ(slot->updates, 12);
    FeatureEstimate estimate;
    bank->get(0, estimate);
    return estimate;
  };
  const FeatureEstimate at_once = learnt_when([](std::size_t) { return false; });
  const FeatureEstimate later = learnt_when([](std::size_t i) { return i >= 3 && i < 7; });
  EXPECT_LT((at_once.x - later.x).norm(), 1e-9);
  EXPECT_LT((at_once.P - later.P).norm(), 1e-9);
}

TEST_F(Stages, AFeatureWithMuchToLearnDoesNotKeepItsNeighbourFromLearning) {
  map_feature(1);
  slot->state = SlotState::kStarting;  // gathers matches that wait for its start
  slot->start.adopt_at_frame = 1000;
  for (int i = 0; i < 15; ++i) {
    next_frame();
    found_at({320, 240}, 0);
    found_at({320, 240}, 1);
    ASSERT_EQ(learn_frame(), LifeEvent::kNone);
    EXPECT_EQ(slots[1].updates, i);
  }
  map_feature(0);
  int frames = 0;
  while (slot->held.size() > 1) {
    next_frame();
    found_at({320, 240}, 0);
    found_at({320, 240}, 1);
    ASSERT_EQ(learn_frame(), LifeEvent::kNone);
    ASSERT_LT(++frames, 15);
  }
  EXPECT_EQ(slots[0].updates, 15 + frames - 1);
  EXPECT_EQ(slots[1].updates, 15 + frames - 1);
}

TEST_F(Stages, AFeatureRefusedTenTimesLetsGoOfItsPatchAndIsStillGivenUpWhenUnseen) {
  map_feature();
  for (int i = 0; i < 11; ++i) {
    next_frame();
    found_at({420.0, 240.0});
    ASSERT_EQ(learn_frame(), LifeEvent::kNone);
  }
  EXPECT_GT(job.frame->index - slot->last_found_frame, FrameRate().frames(kCarriedUnseen))
      << "the next search starts where the map says";
  int frames = 0;
  do {
    next_frame();
    ASSERT_LT(++frames, 1000);
  } while (learn_frame() != LifeEvent::kLostUnseen);
  EXPECT_EQ(slot->state, SlotState::kEmpty);
}

// The surface breathes from left to right, by 1 mm and every 2 s; it is found after 3 s.
struct Breathing : Stages {
  Breathing() {
    settings.estimator.layout.respiratory_harmonics = 2;
    history = std::make_unique<FrameHistory>(settings.estimator.layout);
    bank =
        std::make_unique<MapBank>(BankSettings{.layout = settings.estimator.layout, .features = 2}, Precision::kDouble);
    group = std::make_unique<FeatureGroup>(*bank, 0, slots);
    respiration.state = RespirationState::kSearching;
    respiration.unknown_displacement_mm = 5.0;
  }

  RespiratoryClock truth() const {
    RespiratoryClock found = respiration;
    found.state = RespirationState::kLocked;
    found.time = Instant(milliseconds(5000));
    found.rate_rad_per_s = std::numbers::pi;
    return found;
  }
  void see() {
    next_frame();
    found_at({320.0 + 5.0 * std::cos(truth().at(job.frame->stamp.capture).phase_rad), 240.0});
  }
  void find_breathing() {
    respiration = truth();
    history->retell_respiration(respiration);
    group->begin_breath(BreathWave{}, true);
  }
  void map_and_see(int frames) {
    map_feature();
    for (int i = 0; i < frames; ++i) {
      see();
      ASSERT_EQ(learn_frame(), LifeEvent::kNone);
    }
  }
};

TEST_F(Breathing, WhatWasSeenBeforeItWasFoundIsLearntOnceMore) {
  map_and_see(90);
  ASSERT_LT(slot->held.size(), 5U);
  find_breathing();
  ASSERT_EQ(slot->held.size(), 90U);
  const int updates = slot->updates;
  for (int i = 0; i < 40; ++i) {
    next_frame();
    ASSERT_EQ(learn_frame(), LifeEvent::kNone);
  }
  EXPECT_EQ(slot->held.size(), 0U);
  EXPECT_LE(slot->updates - updates, 4) << "what was judged before is no new evidence";
  FeatureEstimate estimate;
  bank->get(0, estimate);
  const int first = 1 + 2 * settings.estimator.layout.cardiac_harmonics;
  EXPECT_NEAR(estimate.x(first), 1.0, 0.02);
  EXPECT_NEAR(estimate.x(first + settings.estimator.layout.respiratory_harmonics), 0.0, 0.02);
}

TEST_F(Breathing, WhatWasSeenBeforeItWasCorrectedIsLearntOnceMoreAndHardlyCountsTwice) {
  const auto learn_what_is_held = [&] {
    for (int i = 0; i < 90; ++i) {
      see();
      ASSERT_EQ(learn_frame(), LifeEvent::kNone);
    }
    ASSERT_LT(slot->held.size(), 5U);
  };
  const BasisLayout& layout = settings.estimator.layout;
  const int b_1 = 1 + 2 * layout.cardiac_harmonics + layout.respiratory_harmonics;  // zero in truth
  const auto wave_and_deviation = [&] {
    FeatureEstimate estimate;
    bank->get(0, estimate);
    return std::pair(estimate.x(b_1), std::sqrt(estimate.P(b_1, b_1)));
  };
  map_and_see(90);
  respiration = truth();
  respiration.rate_rad_per_s *= 1.02;  // a false one
  history->retell_respiration(respiration);
  group->begin_breath(BreathWave{}, true);
  learn_what_is_held();
  const auto [wrong, deviation] = wave_and_deviation();
  EXPECT_GT(std::abs(wrong), 0.05);
  respiration = truth();
  history->retell_respiration(respiration);
  group->learn_again();
  ASSERT_EQ(slot->held.size(), 180U);
  EXPECT_GT(wave_and_deviation().second, 10.0 * deviation);
  learn_what_is_held();
  const auto [right, deviation_after] = wave_and_deviation();
  EXPECT_NEAR(right, 0.0, 0.01);
  EXPECT_NEAR(deviation_after, deviation * std::sqrt(180.0 / 270.0), 0.05 * deviation) << "of 270 matches, each once";
}

TEST_F(Breathing, WhatWasSeenBeforeItWasFoundIsLeftWhereItIsNotToBeLearntAgain) {
  map_and_see(90);
  const std::uint32_t held = slot->held.size();
  respiration = truth();
  history->retell_respiration(respiration);
  group->begin_breath(BreathWave{}, false);
  EXPECT_EQ(slot->held.size(), held);
}

TEST_F(Breathing, WithASlowTrackerErrorNothingIsLearntOnceMore) {
  slot->slow_error = std::make_unique<CorrelatedPoseNoise>(bank->layout().state_size(), 0.5);
  map_and_see(90);
  const std::uint32_t held = slot->held.size();
  find_breathing();
  FeatureEstimate begun;
  bank->get(0, begun);
  group->learn_again();
  EXPECT_EQ(slot->held.size(), held);
  FeatureEstimate estimate;
  bank->get(0, estimate);
  EXPECT_EQ(estimate.P, begun.P);
}

TEST_F(Breathing, AStartOfBeforeItWasFoundIsSolvedOnceMore) {
  slot->state = SlotState::kTracked;
  LifeEvent event = LifeEvent::kNone;
  while (event == LifeEvent::kNone) {
    see();
    event = learn_frame();
  }
  ASSERT_EQ(event, LifeEvent::kStartRequested);
  const Observation before = slot->start.observations[5];
  find_breathing();
  const auto finish_start = [&] {
    slot->start.outcome.status = BatchStatus::kOk;
    slot->start.outcome.estimate =
        prior_estimate(settings.estimator.layout, settings.estimator.prior, Vector3d(0, 0, 100));
    slot->start.due = true;
    do {
      next_frame();
      event = learn_frame();
    } while (event == LifeEvent::kNone && slot->state == SlotState::kStarting);
  };
  finish_start();
  ASSERT_EQ(event, LifeEvent::kStartRequested);
  const Observation& observation = slot->start.observations[5];
  EXPECT_EQ(observation.z, before.z);
  EXPECT_EQ(observation.b, history->find(5)->b);
  EXPECT_GT((observation.b - before.b).norm(), 0.5);
  EXPECT_LT(observation.R.trace(), 0.1 * before.R.trace());
  finish_start();
  EXPECT_EQ(event, LifeEvent::kNone);
  EXPECT_EQ(slot->state, SlotState::kMapped);
}

TEST_F(Stages, WhatIsInflatedIsToldByWhatComesFromThenOn) {
  map_feature();
  slot->largest_deviation_mm = 0.1;
  for (int i = 0; i < 1000; ++i) slot->repeated.add(Matrix2d::Identity(), Matrix2d::Identity(), 1.0);
  ASSERT_NEAR(slot->repeated.factor(), 2.0, 1e-6);
  group->doubt();
  EXPECT_EQ(slot->repeated.factor(), 1.0);
}

TEST_F(Stages, NothingIsShownOfAFeatureBeforeItsStart) {
  for (const SlotState state : {SlotState::kEmpty, SlotState::kTracked, SlotState::kStarting}) {
    slot->state = state;
    next_frame();
    EXPECT_FALSE(group->prediction(0).valid);
    EXPECT_TRUE(shown().empty());
  }
}

TEST_F(Stages, AMappedFeatureThatIsNotMatchedSaysSo) {
  map_feature();
  slot->converged = true;
  next_frame();
  ASSERT_EQ(shown().size(), 1U);
  EXPECT_EQ(shown()[0].state, FeatureState::kConverged);
  EXPECT_EQ(shown()[0].reason, FeatureReason::kNotObserved);
  found_at({320, 240});
  EXPECT_EQ(shown()[0].reason, FeatureReason::kNone);
}

TEST_F(Stages, WhatIsPredictedAndShownIsWhatTheBankHolds) {
  map_feature();
  for (int i = 0; i < 600; ++i) slot->repeated.add(Matrix2d::Identity(), Matrix2d::Identity(), 1.0);
  for (int i = 0; i < 5; ++i) {
    next_frame();
    found_at({320.5, 239.5});
    ASSERT_EQ(learn_frame(), LifeEvent::kNone);
  }
  next_frame();
  FeatureEstimate estimate;
  bank->get(0, estimate);
  const FrameRecord& frame = *job.frame;
  const Vector3d spread = velocity_of(estimate.x, frame.b_rate, frame.phase.rate_rad_per_s) * frame.phase.deviation_s;
  const MapPrediction prediction = group->prediction(0);
  ASSERT_TRUE(prediction.valid);
  EXPECT_LT((prediction.p_WF - estimate.position(frame.b)).norm(), 1e-12);
  EXPECT_LT((prediction.covariance_W - estimate.position_covariance(frame.b) - spread * spread.transpose()).norm(),
            1e-12);
  const std::vector<FeatureSnapshot> snapshots = shown();
  ASSERT_EQ(snapshots.size(), 1U);
  EXPECT_EQ(snapshots[0].x, estimate.x);
  const double repeated = slot->repeated.factor();
  EXPECT_GT(repeated, 1.2) << "with five more matches";
  for (const Matrix3d& covariance : snapshots[0].covariances_W_mm2) {
    EXPECT_LT((covariance - repeated * estimate.position_covariance(job.evaluated_b[0])).norm(), 1e-12);
  }
}

// Two mapped features whose matches scatter by as much as they are said to; the first can be made to drift.

}  // namespace
}  // namespace perimap

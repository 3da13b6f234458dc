#include "core/pipeline/feature_life.hpp"

#include "tests/unit/pipeline/stages.hpp"

namespace perimap {
namespace {

TEST_F(Stages, ATrackedFeatureWithoutMatchesIsGivenUpSoon) {
  slot->state = SlotState::kTracked;
  next_frame();
  found_at({320, 240});
  int frames = 0;
  while (learn_frame() != LifeEvent::kLostUnseen) {
    next_frame();
    ASSERT_LT(++frames, 20);
  }
  EXPECT_EQ(slot->state, SlotState::kEmpty);
}

// Its last view has drifted too far: it is followed, and another would serve better.
TEST_F(Stages, ATrackedFeatureThatIsFollowedWithoutBeingLearntFromIsGivenUp) {
  slot->state = SlotState::kTracked;
  next_frame();
  found_at({320, 240});
  int frames = 0;
  do {
    next_frame();
    ++frames;
    slot->match.state = MatchState::kFound;
    slot->last_found_frame = job.frame->index;
  } while (learn_frame() != LifeEvent::kLostUnseen && frames < 1000);
  EXPECT_NEAR(frames * frame_ms, 2000, 2 * frame_ms);
  EXPECT_EQ(slot->state, SlotState::kEmpty);
}

TEST_F(Stages, ATrackedFeatureIsCarriedAsLongWhateverTheRate) {
  for (const int ms : {66, 16, 8, 4}) {
    history = std::make_unique<FrameHistory>(settings.estimator.layout);
    frame_ms = ms;
    slot->state = SlotState::kTracked;
    for (int i = 0; i < 20; ++i) {
      next_frame();
      found_at({320, 240});
      ASSERT_EQ(learn_frame(), LifeEvent::kNone);
    }
    int frames = 0;
    do {
      next_frame();
      ++frames;
    } while (learn_frame() != LifeEvent::kLostUnseen && frames < 1000);
    EXPECT_NEAR(frames * ms, to_seconds(kCarriedUnseen) * 1e3, 1.5 * ms) << ms << " ms a frame";
  }
}

TEST_F(Stages, AStartsMatchesSpanAsLongWhereTheCameraIsFaster) {
  for (const int ms : {33, 16, 8, 4}) {
    history = std::make_unique<FrameHistory>(settings.estimator.layout);
    frame_ms = ms;
    slot->held.clear();
    slot->state = SlotState::kTracked;
    int frames = 0;
    LifeEvent outcome = LifeEvent::kNone;
    while (outcome == LifeEvent::kNone && frames < 1000) {
      next_frame();
      found_at({320, 240});
      outcome = learn_frame();
      ++frames;
    }
    ASSERT_EQ(outcome, LifeEvent::kStartRequested) << ms << " ms a frame";
    // Before the rate is known each match is held.
    EXPECT_NEAR(frames * ms, settings.estimator.start_observations * 33, 250) << ms << " ms a frame";
    const FrameRate rate = job.frame->rate;
    EXPECT_EQ(slot->start.adopt_at_frame, job.frame->index + rate.frames(settings.adoption_delay));
    EXPECT_NEAR(static_cast<double>(rate.frames(settings.adoption_delay)) * ms, 500, ms);
  }
}

TEST_F(Stages, AMappedFeatureThatNoMotionExplainsIsStartedAnewUnderItsId) {
  map_feature();
  std::mt19937 generator(1);
  std::normal_distribution<double> normal(0.0, 3.0);
  int frames = 0;
  int inconsistent = 0;
  LifeEvent outcome = LifeEvent::kNone;
  while (outcome == LifeEvent::kNone) {
    next_frame();
    found_at({320 + normal(generator), 240 + normal(generator)});
    outcome = learn_frame();
    inconsistent += slot->health.state() == HealthState::kInconsistent ? 1 : 0;
    ASSERT_LT(++frames, 600);
  }
  EXPECT_EQ(outcome, LifeEvent::kStartedAnew);
  EXPECT_GT(inconsistent, 100) << "said so before";
  EXPECT_EQ(slot->state, SlotState::kTracked);
  EXPECT_EQ(slot->id, 1U);
  EXPECT_EQ(slot->held.size(), 0U);
}

// Tissue that was cut or stitched stays otherwise.
TEST_F(Stages, AMappedFeatureThatStaysPressedIsStartedAnewAfterAWhile) {
  map_feature();
  next_frame();
  slot->pressed = true;
  slot->pressed_since = job.frame->stamp.capture;
  int frames = 0;
  LifeEvent outcome = LifeEvent::kNone;
  while (outcome == LifeEvent::kNone && frames < 600) {
    next_frame();
    found_at({320, 240});
    outcome = learn_frame();
    ++frames;
  }
  EXPECT_EQ(outcome, LifeEvent::kStartedAnew);
  EXPECT_NEAR(frames * frame_ms, 15000, 2 * frame_ms);
  EXPECT_FALSE(slot->pressed);
}

TEST_F(Stages, ATrackedFeatureAsksForItsStartOnceItHasEnoughMatches) {
  slot->state = SlotState::kTracked;
  int frames = 0;
  LifeEvent outcome = LifeEvent::kNone;
  while (outcome == LifeEvent::kNone) {
    next_frame();
    found_at({320, 240});
    outcome = learn_frame();
    ++frames;
  }
  EXPECT_EQ(outcome, LifeEvent::kStartRequested);
  EXPECT_EQ(frames, settings.estimator.start_observations);
  EXPECT_EQ(slot->start.count, settings.estimator.start_observations);
  EXPECT_EQ(slot->start.adopt_at_frame, job.frame->index + FrameRate().frames(settings.adoption_delay));
}

TEST_F(Stages, AnAdoptedFeatureWasLastObservedWhenItsStartsLastMatchWas) {
  slot->state = SlotState::kTracked;
  LifeEvent outcome = LifeEvent::kNone;
  while (outcome == LifeEvent::kNone) {
    next_frame();
    found_at({320, 240});
    outcome = learn_frame();
  }
  const Instant last = job.frame->stamp.capture;
  slot->start.outcome.status = BatchStatus::kOk;
  slot->start.outcome.estimate =
      prior_estimate(settings.estimator.layout, settings.estimator.prior, Vector3d(0, 0, 100));
  slot->start.due = true;
  while (slot->state == SlotState::kStarting) {
    next_frame();
    ASSERT_EQ(learn_frame(), LifeEvent::kNone);
  }
  EXPECT_EQ(slot->state, SlotState::kMapped);
  EXPECT_EQ(job.frame->index, slot->start.adopt_at_frame);
  EXPECT_EQ(slot->last_observed, last);
}

TEST_F(Stages, AFeatureThatIsSeenFromOnePlaceAloneIsNotCalledConverged) {
  for (const double sway : {0.0, 5.0}) {
    sway_mm = sway;
    slot->clear();
    slot->map({.last_observed = Instant(milliseconds(5000)), .last_learnt = Instant(milliseconds(5000))});
    bank->set(0, still_feature());
    for (int i = 0; i < 200; ++i) {
      next_frame();
      found_at({320 - settings.camera.fx * current->pose.X_WC.t.x() / 100, 240});
      ASSERT_EQ(learn_frame(), LifeEvent::kNone);
    }
    EXPECT_LT(slot->largest_deviation_mm, settings.estimator.converged_deviation_mm);
    EXPECT_GT(slot->updates, 100);
    EXPECT_EQ(slot->converged, sway > 0) << sway;
  }
}

TEST_F(Stages, AStartUnderALawThatHasGivenWayIsSolvedOnceMore) {
  slot->state = SlotState::kTracked;
  job.law.probabilities.fill(1.0 / 3.0);
  LifeEvent event = LifeEvent::kNone;
  while (event == LifeEvent::kNone) {
    next_frame();
    found_at({320, 240});
    event = learn_frame();
  }
  ASSERT_TRUE(slot->start.law.laws().undecided());
  const Observation linear = slot->start.observations[5];
  slot->start.outcome.status = BatchStatus::kOk;
  slot->start.outcome.estimate = still_feature();
  slot->start.due = true;
  job.law = LawBelief{.settings = {.law = PhaseLaw::kTimeLocked}};
  history->retell_phases(clock.clock().with_law(job.law));
  do {
    next_frame();
    event = learn_frame();
  } while (event == LifeEvent::kNone);
  EXPECT_EQ(event, LifeEvent::kStartRequested);
  EXPECT_EQ(slot->state, SlotState::kStarting);
  EXPECT_FALSE(slot->start.due);
  EXPECT_EQ(slot->start.law.laws(), job.law.laws());
  EXPECT_EQ(slot->start.adopt_at_frame, job.frame->index + FrameRate().frames(settings.adoption_delay));
  EXPECT_EQ(slot->start.observations[5].z, linear.z);
  const Instant capture = slot->start.captures[5];
  const double told_rad = clock.clock().with_law(job.law).at(capture).phase_rad;
  EXPECT_GT((slot->start.observations[5].b - linear.b).norm(), 0.01);
  EXPECT_EQ(slot->start.observations[5].b, basis_at(settings.estimator.layout, told_rad, {}));

  slot->start.due = true;
  while (slot->state == SlotState::kStarting) {
    next_frame();
    ASSERT_EQ(learn_frame(), LifeEvent::kNone);
  }
  EXPECT_EQ(slot->state, SlotState::kMapped);
}

TEST_F(Stages, AStartThatItsObservationsContradictIsAdoptedAsUncertain) {
  const auto deviation_with = [&](double misfit) {
    slot->state = SlotState::kStarting;
    slot->start.count = 1;
    slot->held.clear();
    slot->held.push({});
    slot->start.adopt_at_frame = 0;
    slot->start.outcome.status = BatchStatus::kOk;
    slot->start.outcome.estimate = still_feature();
    slot->start.outcome.misfit = misfit;
    slot->start.due = true;
    next_frame();
    EXPECT_EQ(learn_frame(), LifeEvent::kNone);
    EXPECT_EQ(slot->state, SlotState::kMapped);
    FeatureEstimate adopted;
    bank->get(0, adopted);
    return std::sqrt(adopted.P(0, 0));
  };
  const double deviation_mm = std::sqrt(still_feature().P(0, 0));
  EXPECT_NEAR(deviation_with(0.9 * kContradictedMisfit), deviation_mm, 1e-6);
  EXPECT_NEAR(deviation_with(1.1 * kContradictedMisfit), std::hypot(deviation_mm, kInflation_mm), 0.01);
}

TEST_F(Stages, ALateStartIsToldOnceAndAdoptedWhenItComes) {
  slot->state = SlotState::kStarting;
  slot->start.adopt_at_frame = 0;
  slot->start.count = 0;
  slot->start.outcome.status = BatchStatus::kDiverged;
  next_frame();
  EXPECT_EQ(learn_frame(), LifeEvent::kAdoptionLate);
  next_frame();
  EXPECT_EQ(learn_frame(), LifeEvent::kNone);
  slot->start.due = true;
  next_frame();
  EXPECT_EQ(learn_frame(), LifeEvent::kStartFailed);
  EXPECT_EQ(slot->state, SlotState::kTracked) << "a failed start tries again";
}

TEST_F(Stages, AFeatureWhoseStartsFailIsKeptWhereHardlyAnyCanBeStarted) {
  job.starts_fail_alike = true;
  for (int i = 0; i < 10; ++i) {
    slot->state = SlotState::kStarting;
    slot->start.adopt_at_frame = 0;
    slot->start.count = 0;
    slot->start.outcome.status = BatchStatus::kTooManyOutliers;
    slot->start.due = true;
    next_frame();
    ASSERT_EQ(learn_frame(), LifeEvent::kStartFailed);
    ASSERT_EQ(slot->state, SlotState::kTracked);
  }
}

TEST_F(Stages, StartsFailAlikeWhereMoreFailThanAreMapped) {
  slots[0].state = slots[1].state = SlotState::kTracked;
  EXPECT_FALSE(starts_fail_alike(slots));
  slots[0].failed_starts = 1;
  EXPECT_TRUE(starts_fail_alike(slots));
  slots[1].state = SlotState::kMapped;
  EXPECT_FALSE(starts_fail_alike(slots));
}

TEST_F(Stages, AFeatureWhoseStartsFailIsGivenUpForThat) {
  int failed = 0;
  for (LifeEvent event = LifeEvent::kNone; event != LifeEvent::kLostUnstarted; ++failed) {
    slot->state = SlotState::kStarting;
    slot->start.adopt_at_frame = 0;
    slot->start.count = 0;
    slot->start.outcome.status = BatchStatus::kTooManyOutliers;
    slot->start.due = true;
    next_frame();
    event = learn_frame();
    ASSERT_TRUE(event == LifeEvent::kStartFailed || event == LifeEvent::kLostUnstarted);
    ASSERT_LT(failed, 10);
  }
  EXPECT_GT(failed, 1);
  EXPECT_EQ(slot->state, SlotState::kEmpty);
}

class StagesOnSurface : public Stages {
 protected:
  StagesOnSurface() {
    slot->state = SlotState::kTracked;
    job.surface_there = true;
  }

  // Frames with a match each, until something comes of it.
  LifeEvent follow() {
    LifeEvent event = LifeEvent::kNone;
    while (event == LifeEvent::kNone && frames < 300) {
      next_frame();
      found_at({320, 240});
      event = learn_frame();
      ++frames;
    }
    return event;
  }
  // What housekeeping made of the start.
  void solved(SurfaceStartKind kind) {
    slot->start.on_surface = kind;
    slot->start.outcome.status = BatchStatus::kOk;
    slot->start.outcome.estimate = still_feature();
    slot->start.due = true;
  }

  int frames = 0;
};

TEST_F(StagesOnSurface, AFeatureAsksForAStartOnTheSurfaceByAThirdOfTheMatches) {
  ASSERT_EQ(follow(), LifeEvent::kStartRequested);
  EXPECT_EQ(frames, settings.estimator.start_observations / 3);
  EXPECT_EQ(slot->start.count, frames);
  EXPECT_EQ(slot->start.asked, StartAsked::kOnSurface);
  solved(SurfaceStartKind::kStarted);
  EXPECT_EQ(follow(), LifeEvent::kBegunOnSurface);
  EXPECT_EQ(slot->state, SlotState::kMapped);
  EXPECT_TRUE(slot->began_on_surface);
}

TEST_F(StagesOnSurface, WhatIsBesideTheSurfaceWaitsForAllMatchesAndIsTriedOnceMore) {
  ASSERT_EQ(follow(), LifeEvent::kStartRequested);
  solved(SurfaceStartKind::kNotThere);
  ASSERT_EQ(follow(), LifeEvent::kStartRequested);
  EXPECT_EQ(frames, settings.estimator.start_observations);
  EXPECT_EQ(slot->start.count, settings.estimator.start_observations);
  EXPECT_EQ(slot->start.asked, StartAsked::kOnSurfaceOrAlone);
  solved(SurfaceStartKind::kNotThere);
  while (slot->state == SlotState::kStarting) {
    next_frame();
    ASSERT_EQ(learn_frame(), LifeEvent::kNone);
  }
  EXPECT_EQ(slot->state, SlotState::kMapped);
  EXPECT_FALSE(slot->began_on_surface);
}

TEST_F(StagesOnSurface, WhatContradictsTheSurfaceIsToldOnceAndStartsAlone) {
  ASSERT_EQ(follow(), LifeEvent::kStartRequested);
  solved(SurfaceStartKind::kContradicts);
  EXPECT_EQ(follow(), LifeEvent::kOffSurface);
  EXPECT_EQ(slot->state, SlotState::kTracked);
  ASSERT_EQ(follow(), LifeEvent::kStartRequested);
  EXPECT_EQ(slot->start.count, settings.estimator.start_observations);
  EXPECT_EQ(slot->start.asked, StartAsked::kAlone);
}

TEST_F(StagesOnSurface, AFeatureThatIsStartedAnewStartsAlone) {
  map_feature();
  std::mt19937 generator(1);
  std::normal_distribution<double> normal(0.0, 3.0);
  LifeEvent event = LifeEvent::kNone;
  for (int i = 0; event != LifeEvent::kStartedAnew && i < 600; ++i) {
    next_frame();
    found_at({320 + normal(generator), 240 + normal(generator)});
    event = learn_frame();
  }
  ASSERT_EQ(event, LifeEvent::kStartedAnew);
  ASSERT_EQ(follow(), LifeEvent::kStartRequested);
  EXPECT_EQ(slot->start.asked, StartAsked::kAlone);
}

TEST_F(Stages, AFeatureThatIsForgottenWhileItStartsIsNotLost) {
  slot->state = SlotState::kStarting;
  slot->forgotten = true;
  slot->start.adopt_at_frame = 0;
  slot->start.due = true;
  next_frame();
  EXPECT_EQ(learn_frame(), LifeEvent::kNone);
  EXPECT_EQ(slot->state, SlotState::kEmpty);
}

TEST_F(Stages, AFeatureThatIsAlwaysFoundWhereItsEstimateRefusesItIsGivenUpForThat) {
  map_feature();
  LifeEvent event = LifeEvent::kNone;
  for (int i = 0; event == LifeEvent::kNone; ++i) {
    next_frame();
    found_at({420.0, 240.0});
    event = learn_frame();
    ASSERT_LT(i, 200);
  }
  EXPECT_EQ(event, LifeEvent::kLostRefused);
  EXPECT_EQ(slot->state, SlotState::kEmpty);
}

TEST_F(Stages, TheProgressOfStartsIsThatOfTrackedFeatures) {
  EXPECT_EQ(start_progress(slots, 60).features, 0U);
  EXPECT_EQ(start_progress(slots, 60).mean_matches, 0U);
  slots[0].state = slots[1].state = SlotState::kTracked;
  for (int i = 0; i < 70; ++i) {
    next_frame();
    found_at({320, 240}, 0);
    if (i < 10) found_at({320, 240}, 1);
  }
  const StartProgress progress = start_progress(slots, 60);
  EXPECT_EQ(progress.features, 2U);
  EXPECT_EQ(progress.most_matches, 60U);
  EXPECT_EQ(progress.mean_matches, 35U);
  slots[0].state = SlotState::kMapped;
  EXPECT_EQ(start_progress(slots, 60).features, 1U);
  EXPECT_EQ(start_progress(slots, 60).most_matches, 10U);
}

}  // namespace
}  // namespace perimap

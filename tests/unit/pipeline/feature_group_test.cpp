#include "core/pipeline/feature_group.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "core/pipeline/batch_starter.hpp"
#include "core/pipeline/feature_life.hpp"
#include "core/pipeline/match_covariance.hpp"
#include "core/pipeline/start_progress.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

// A still camera at the origin looking along z, beats every 800 ms, frames every 33 ms from 5 s on. Beats are known
// ahead, so that every frame's phase is exact at once, but where a test says otherwise. Tests that need one feature use
// the first slot. A match is learnt a frame after it was found, because the sweep comes before the search.
struct Stages : ::testing::Test {
  PipelineSettings settings;
  PixelModel model;
  CardiacClockTracker clock{{}};
  RespiratoryClock respiration;
  std::unique_ptr<FrameHistory> history;
  std::vector<FeatureSlot> slots{2};
  FeatureSlot* slot = slots.data();
  std::unique_ptr<MapBank> bank;
  std::unique_ptr<FeatureGroup> group;
  FrameJob job;
  int next_beat_ms = 1000;
  int beats_known_ahead_ms = 2000;
  milliseconds beat_deviation{1};
  double pose_variance_mm2 = 0.0;
  FrameRecord* current = nullptr;

  Stages() {
    settings.camera = {640, 480, 500, 500, 320, 240, 0, 0, 0, 0, 0};
    settings.estimator.layout.cardiac_harmonics = 2;
    model.camera = settings.camera;
    history = std::make_unique<FrameHistory>(settings.estimator.layout);
    bank =
        std::make_unique<MapBank>(BankSettings{.layout = settings.estimator.layout, .features = 2}, Precision::kDouble);
    group = std::make_unique<FeatureGroup>(*bank, 0, slots);
    beat_until(5000);
    slots[0].id = 1;
    slots[1].id = 2;
  }

  void beat_until(int ms) {
    for (; next_beat_ms <= ms; next_beat_ms += 800) {
      const Instant t(milliseconds{next_beat_ms});
      clock.on_r_peak({t, t + milliseconds(60), 1.0, beat_deviation});
    }
  }

  void next_frame() {
    const auto n = static_cast<int>(history->count());
    const Instant capture(milliseconds(5000 + 33 * n));
    beat_until(5000 + 33 * n + beats_known_ahead_ms);
    FrameRecord& frame = history->append({static_cast<std::uint64_t>(n), capture, capture + milliseconds(12)});
    CameraPose pose;
    pose.state = CameraPose::State::kInterpolated;
    pose.position_variance_mm2 = pose_variance_mm2;
    FrameHistory::set_pose(frame, pose);
    history->set_phase(frame, clock.clock(), respiration);
    history->refresh_phases(clock.clock(), respiration);
    job.frame = current = &frame;
    job.about_capture = bases_about(settings.estimator.layout, frame.phase, frame.respiration);
    job.history = history.get();
    job.evaluated_b.fill(basis_at(settings.estimator.layout, 1.0));
    job.plan.end = kCovariances;
    for (FeatureSlot& s : slots) s.match = PatchMatch{};
    group->sweep(job);
  }

  void found_at(const Vector2d& px, int lane = 0) {
    FeatureSlot& found = slots[static_cast<std::size_t>(lane)];
    found.match.state = MatchState::kFound;
    found.match.px = px;
    found.match.covariance_px2 = 0.05 * Matrix2d::Identity();
    found.match_agrees = (px - Vector2d(320, 240)).norm() < 20.0;
    found.last_found_frame = job.frame->index;
    hold_match(found, job);
  }

  LifeEvent learn_frame() {
    group->learn(model, settings.estimator);
    return advance(*slot, *bank, 0, job, model, settings);
  }

  // A mapped feature at (0, 0, 100) mm, seen at the image centre, with little deviation.
  FeatureEstimate still_feature() const {
    FeatureEstimate estimate = prior_estimate(settings.estimator.layout, settings.estimator.prior, Vector3d(0, 0, 100));
    estimate.P *= 1e-4;
    return estimate;
  }
  void map_feature(int lane = 0) {
    slots[static_cast<std::size_t>(lane)].state = SlotState::kMapped;
    bank->set(lane, still_feature());
  }

  std::vector<FeatureSnapshot> shown() {
    ShardSnapshot publisher;
    ShardSnapshot model_view;
    group->evaluate(job, publisher, model_view);
    EXPECT_EQ(publisher.features.size(), model_view.features.size());
    return publisher.features;
  }
};

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
  EXPECT_EQ(slot->start.adopt_at_frame, job.frame->index + static_cast<std::uint64_t>(settings.adoption_delay_frames));
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
  EXPECT_EQ(slot->start.adopt_at_frame, job.frame->index + static_cast<std::uint64_t>(settings.adoption_delay_frames));
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
  EXPECT_EQ(slot->refused_in_a_row, 1);
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
  EXPECT_GT(job.frame->index - slot->last_found_frame, kCarriedMissesAllowed)
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
  for (const Matrix3d& covariance : snapshots[0].covariances_W_mm2) {
    EXPECT_LT((covariance - estimate.position_covariance(job.evaluated_b[0])).norm(), 1e-12);
  }
}

// Two mapped features whose matches scatter by as much as they are said to; the first can be made to drift.
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
  BatchStarter starter(settings, slots);
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

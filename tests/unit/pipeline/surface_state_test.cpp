#include "core/pipeline/surface_state.hpp"

#include <gtest/gtest.h>

namespace perimap {
namespace {

constexpr SurfaceFooting kMapped{.mapped = true};

PhaseEstimate locked() {
  PhaseEstimate phase;
  phase.state = PhaseState::kLocked;
  return phase;
}

TEST(SurfaceState, IsGoodWhenNothingIsWrong) {
  EXPECT_EQ(reason_of(locked(), Rhythm::kPredictable, kMapped), SurfaceReason::kNone);
  EXPECT_EQ(state_of(SurfaceReason::kNone), SurfaceState::kGood);
}

TEST(SurfaceState, IsDegradedWhileTheLawOfTheMotionIsUndecided) {
  PhaseEstimate phase = locked();
  phase.law_undecided = true;
  EXPECT_EQ(reason_of(phase, Rhythm::kPredictable, kMapped), SurfaceReason::kLawUndecided);
  EXPECT_EQ(state_of(SurfaceReason::kLawUndecided), SurfaceState::kDegraded);
}

TEST(SurfaceState, IsDegradedWhileTheRhythmIsUnpredictable) {
  EXPECT_EQ(reason_of(locked(), Rhythm::kUnpredictable, kMapped), SurfaceReason::kRhythmUnpredictable);
  EXPECT_EQ(state_of(SurfaceReason::kRhythmUnpredictable), SurfaceState::kDegraded);
}

TEST(SurfaceState, IsDegradedWhenTheImagesShowNothingOfTheMap) {
  EXPECT_EQ(reason_of(locked(), Rhythm::kPredictable, {.mapped = true, .not_seen = true}), SurfaceReason::kNotSeen);
  EXPECT_EQ(state_of(SurfaceReason::kNotSeen), SurfaceState::kDegraded);
}

TEST(SurfaceState, IsDegradedWhileTheCameraKeepsStillAndNothingHasConverged) {
  ShardSnapshot shard;
  shard.doubts.still = true;
  shard.features.resize(2);
  shard.features[0].state = FeatureState::kConverging;
  const ShardSnapshot* const shards[] = {&shard};
  const SurfaceFooting footing = footing_of(shards);
  EXPECT_EQ(reason_of(locked(), Rhythm::kPredictable, footing), SurfaceReason::kNoParallax);
  EXPECT_EQ(state_of(SurfaceReason::kNoParallax), SurfaceState::kDegraded);
  shard.features[1].state = FeatureState::kConverged;
  shard.features[1].expected = shard.features[1].in_sight = true;
  EXPECT_EQ(reason_of(locked(), Rhythm::kPredictable, footing_of(shards)), SurfaceReason::kNone)
      << "it was seen before";
}

TEST(SurfaceState, SaysThatTheSetUpIsUncertainWhereThatAloneHoldsFeaturesBack) {
  ShardSnapshot shard;
  shard.features.resize(2);
  for (FeatureSnapshot& feature : shard.features) {
    feature.state = FeatureState::kConverging;
    feature.expected = feature.in_sight = true;
  }
  const ShardSnapshot* const shards[] = {&shard};
  const auto reason = [&] { return reason_of(locked(), Rhythm::kPredictable, footing_of(shards)); };
  EXPECT_EQ(reason(), SurfaceReason::kNothingConverged);
  shard.features[1].held_back = true;
  EXPECT_EQ(reason(), SurfaceReason::kSetupUncertain);
  EXPECT_EQ(state_of(SurfaceReason::kSetupUncertain), SurfaceState::kDegraded);
  shard.features[0].state = FeatureState::kConverged;
  EXPECT_EQ(reason(), SurfaceReason::kNone);
}

TEST(SurfaceState, IsDegradedWhileTheSetUpIsDoubtedAndNothingIsCalledConverged) {
  ShardSnapshot shard;
  shard.doubts.setup_doubted = true;
  shard.doubts.setup_widening_mm = 3.0;
  shard.features.resize(1);
  shard.features[0].state = FeatureState::kConverged;
  shard.features[0].expected = shard.features[0].in_sight = true;
  const ShardSnapshot other;
  const ShardSnapshot* const shards[] = {&other, &shard};
  SurfaceFooting footing = footing_of(shards);
  EXPECT_EQ(footing.doubts.setup_widening_mm, 3.0);
  EXPECT_EQ(footing.doubts.setup_variance_mm2(), 3.0) << "a third of its square on each axis";
  footing.breath_doubtful = true;
  EXPECT_EQ(reason_of(locked(), Rhythm::kPredictable, footing), SurfaceReason::kSetupDoubted)
      << "a set-up that is off displaces the surface as breathing may";
  EXPECT_EQ(state_of(SurfaceReason::kSetupDoubted), SurfaceState::kDegraded);
  footing.frame_missing = true;
  EXPECT_EQ(reason_of(locked(), Rhythm::kPredictable, footing), SurfaceReason::kFrameMissing);
  footing = footing_of(shards);
  EXPECT_EQ(verdict_of({FeatureState::kConverged, FeatureReason::kNone}, PhaseState::kLocked, footing).state,
            FeatureState::kConverging);
}

TEST(SurfaceState, IsDegradedWhileTheOrganIsNotWhereTheMapHasItAndNothingIsCalledConverged) {
  ShardSnapshot shard;
  shard.doubts.displaced = true;
  shard.features.resize(1);
  shard.features[0].state = FeatureState::kConverged;
  shard.features[0].expected = true;
  const ShardSnapshot other;
  const ShardSnapshot* const shards[] = {&other, &shard};
  SurfaceFooting footing = footing_of(shards);
  EXPECT_TRUE(footing.not_seen);
  EXPECT_EQ(reason_of(locked(), Rhythm::kPredictable, footing), SurfaceReason::kOrganOrTrackerMoved)
      << "which says more than that it is not seen";
  PhaseEstimate contradicted = locked();
  contradicted.contradicted = true;
  EXPECT_EQ(reason_of(contradicted, Rhythm::kPredictable, footing), SurfaceReason::kOrganOrTrackerMoved);
  EXPECT_EQ(state_of(SurfaceReason::kOrganOrTrackerMoved), SurfaceState::kDegraded);
  EXPECT_EQ(verdict_of({FeatureState::kConverged, FeatureReason::kNone}, PhaseState::kLocked, footing).state,
            FeatureState::kConverging);
  footing.doubts.setup_doubted = true;
  EXPECT_EQ(reason_of(locked(), Rhythm::kPredictable, footing), SurfaceReason::kSetupDoubted)
      << "which says which number is off";
}

TEST(SurfaceState, SaysOrganOrTrackerWhereThePatientsToolTellsThemApart) {
  const auto reason_with = [](DisplacedCause first, DisplacedCause second) {
    ShardSnapshot shards[2];
    shards[0].doubts.displaced = shards[1].doubts.displaced = true;
    shards[0].doubts.cause = first;
    shards[1].doubts.cause = second;
    shards[0].features.resize(1);
    const ShardSnapshot still;
    const ShardSnapshot* const all[] = {&still, &shards[0], &shards[1]};
    return reason_of(locked(), Rhythm::kPredictable, footing_of(all));
  };
  EXPECT_EQ(reason_with(DisplacedCause::kOrgan, DisplacedCause::kOrgan), SurfaceReason::kOrganMoved);
  EXPECT_EQ(reason_with(DisplacedCause::kTracker, DisplacedCause::kTracker), SurfaceReason::kTrackerErrs);
  EXPECT_EQ(reason_with(DisplacedCause::kOrgan, DisplacedCause::kTracker), SurfaceReason::kOrganOrTrackerMoved)
      << "of two frames";
  EXPECT_EQ(state_of(SurfaceReason::kOrganMoved), SurfaceState::kDegraded);
  EXPECT_EQ(state_of(SurfaceReason::kTrackerErrs), SurfaceState::kDegraded);
}

TEST(SurfaceState, IsAccountedForWhereItIsPredictedFromBeforeAndNotWhereSomethingElseIsWrongAsWell) {
  PhaseEstimate free_running = locked();
  free_running.state = PhaseState::kFreeRunning;
  SurfaceFooting missing;
  missing.mapped = missing.frame_missing = missing.update_late = missing.pose_missing = true;
  EXPECT_TRUE(is_accounted_for(locked(), Rhythm::kPredictable, missing));
  EXPECT_TRUE(is_accounted_for(free_running, Rhythm::kPredictable, missing));
  EXPECT_FALSE(is_accounted_for(free_running, Rhythm::kEctopic, missing));
  for (bool FrameDoubts::*doubt :
       {&FrameDoubts::picture_repeated, &FrameDoubts::scope_unread, &FrameDoubts::scope_changed,
        &FrameDoubts::pose_repeated, &FrameDoubts::setup_doubted, &FrameDoubts::displaced, &FrameDoubts::unproven}) {
    SurfaceFooting both = missing;
    both.doubts.*doubt = true;
    EXPECT_FALSE(is_accounted_for(free_running, Rhythm::kPredictable, both));
  }
  SurfaceFooting unseen = missing;
  unseen.not_seen = true;
  EXPECT_FALSE(is_accounted_for(locked(), Rhythm::kPredictable, unseen));
  PhaseEstimate ectopic = free_running;
  ectopic.ectopic = true;
  EXPECT_FALSE(is_accounted_for(ectopic, Rhythm::kPredictable, missing));
}

TEST(SurfaceState, SaysOfAMapThatWasMovedWithTheOrganThatThatIsWhyNothingHasConverged) {
  ShardSnapshot shard;
  shard.features.resize(1);
  const ShardSnapshot* const shards[] = {&shard};
  const auto reason = [&] { return reason_of(locked(), Rhythm::kPredictable, footing_of(shards)); };
  EXPECT_EQ(reason(), SurfaceReason::kNothingConverged);
  shard.doubts.settling = true;
  EXPECT_EQ(reason(), SurfaceReason::kOrganMoved);
  shard.features[0].state = FeatureState::kConverged;
  shard.features[0].expected = shard.features[0].in_sight = true;
  EXPECT_EQ(reason(), SurfaceReason::kNone);
  shard.doubts.unproven = true;
  EXPECT_EQ(reason(), SurfaceReason::kOrganMoved);
  shard.doubts.settling = false;
  EXPECT_EQ(reason(), SurfaceReason::kNotSeen);
}

TEST(SurfaceState, IsDegradedWhileTheTrackerOrTheCameraRepeatsItself) {
  ShardSnapshot shard;
  shard.doubts.pose_repeated = true;
  shard.pose_missing = true;
  const ShardSnapshot other;
  const ShardSnapshot* const shards[] = {&other, &shard};
  SurfaceFooting footing = footing_of(shards);
  footing.mapped = true;
  EXPECT_EQ(reason_of(locked(), Rhythm::kPredictable, footing), SurfaceReason::kPoseRepeated)
      << "there is no pose for that";
  footing.doubts.picture_repeated = true;
  EXPECT_EQ(reason_of(locked(), Rhythm::kPredictable, footing), SurfaceReason::kPictureRepeated);
  for (const SurfaceReason reason : {SurfaceReason::kPoseRepeated, SurfaceReason::kPictureRepeated}) {
    EXPECT_EQ(state_of(reason), SurfaceState::kDegraded);
  }
}

TEST(SurfaceState, IsNotGoodWithoutAFeatureThatHasConverged) {
  ShardSnapshot shard;
  shard.features.resize(1);
  shard.features[0].state = FeatureState::kConverging;
  const ShardSnapshot* const shards[] = {&shard};
  EXPECT_EQ(reason_of(locked(), Rhythm::kPredictable, footing_of(shards)), SurfaceReason::kNothingConverged);
  EXPECT_EQ(state_of(SurfaceReason::kNothingConverged), SurfaceState::kDegraded);
}

TEST(SurfaceState, TellsWhatIsWorseFirst) {
  PhaseEstimate phase = locked();
  phase.law_undecided = true;
  EXPECT_EQ(reason_of(phase, Rhythm::kEctopic, kMapped), SurfaceReason::kRhythmEctopic);
  EXPECT_EQ(reason_of(phase, Rhythm::kPredictable, {}), SurfaceReason::kNothingMapped);
  SurfaceFooting footing{.mapped = true, .not_seen = true};
  EXPECT_EQ(reason_of(phase, Rhythm::kEctopic, footing), SurfaceReason::kNotSeen);
  footing.pose_missing = true;
  EXPECT_EQ(reason_of(phase, Rhythm::kEctopic, footing), SurfaceReason::kPoseMissing);
  footing.doubts.scope_changed = true;
  EXPECT_EQ(reason_of(phase, Rhythm::kEctopic, footing), SurfaceReason::kScopeChanged);
  footing.doubts.scope_unread = true;
  EXPECT_EQ(reason_of(phase, Rhythm::kEctopic, footing), SurfaceReason::kScopeUnread);
  EXPECT_EQ(state_of(SurfaceReason::kScopeUnread), SurfaceState::kDegraded);
  EXPECT_EQ(state_of(SurfaceReason::kScopeChanged), SurfaceState::kDegraded);
  phase.state = PhaseState::kFreeRunning;
  EXPECT_EQ(reason_of(phase, Rhythm::kPredictable, kMapped), SurfaceReason::kPhaseFreeRunning);
  phase.state = PhaseState::kLost;
  EXPECT_EQ(reason_of(phase, Rhythm::kPredictable, kMapped), SurfaceReason::kPhaseLost);
}

}  // namespace
}  // namespace perimap

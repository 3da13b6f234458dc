#include "core/pipeline/surface_use.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace perimap {
namespace {

constexpr UseBounds kBounds{5.0, 3.0, 2.0};

// 95 % of whose errors are within so much.
SurfaceFeature feature_within(double mm, FeatureState state = FeatureState::kConverged) {
  SurfaceFeature feature;
  feature.state = state;
  feature.covariance_W_mm2 = mm * mm / 12.0 * Matrix3d::Identity();
  return feature;
}

UseVerdicts verdicts(SurfaceReason reason, const std::vector<SurfaceFeature>& features) {
  const SurfaceState state = reason == SurfaceReason::kNone            ? SurfaceState::kGood
                             : reason == SurfaceReason::kNothingMapped ? SurfaceState::kInvalid
                                                                       : SurfaceState::kDegraded;
  return verdicts_by_use(state, reason, features, kBounds);
}

SurfaceState state_for(SurfaceUse use, const UseVerdicts& verdicts) {
  return verdicts[static_cast<std::size_t>(use)].state;
}

TEST(SurfaceUse, AnErrorsBoundIsTwiceItsRootMeanSquareWhateverItsDirection) {
  Matrix3d along = Matrix3d::Zero();
  along(2, 2) = 4.0;
  EXPECT_DOUBLE_EQ(within_mm(along), 4.0);
  EXPECT_DOUBLE_EQ(within_mm(feature_within(3.0).covariance_W_mm2), 3.0);
}

TEST(SurfaceUse, EachUseHasABoundOfItsOwn) {
  const UseVerdicts verdict = verdicts(SurfaceReason::kNone, {feature_within(2.5), feature_within(2.7)});
  EXPECT_EQ(state_for(SurfaceUse::kDisplay, verdict), SurfaceState::kGood);
  EXPECT_EQ(state_for(SurfaceUse::kMeasure, verdict), SurfaceState::kGood);
  EXPECT_EQ(state_for(SurfaceUse::kContact, verdict), SurfaceState::kDegraded);
  EXPECT_EQ(verdict[1].features, 2U);
  EXPECT_EQ(verdict[2].features, 0U);
}

TEST(SurfaceUse, HalfOfTheConvergedFeaturesAreEnoughAndFewerAreNot) {
  const SurfaceFeature sure = feature_within(1.5), unsure = feature_within(2.5);
  EXPECT_EQ(state_for(SurfaceUse::kContact, verdicts(SurfaceReason::kNone, {sure, unsure})), SurfaceState::kGood);
  EXPECT_EQ(state_for(SurfaceUse::kContact, verdicts(SurfaceReason::kNone, {sure, unsure, unsure})),
            SurfaceState::kDegraded);
  const SurfaceFeature starting = feature_within(1.5, FeatureState::kConverging);
  EXPECT_EQ(state_for(SurfaceUse::kDisplay, verdicts(SurfaceReason::kNone, {starting})), SurfaceState::kDegraded)
      << "what has not converged does not count";
}

TEST(SurfaceUse, WhatIsPredictedFromBeforeMayBeShownAsFarAsItSaysAndNoMore) {
  for (const SurfaceReason reason : {SurfaceReason::kFrameMissing, SurfaceReason::kUpdateLate,
                                     SurfaceReason::kPhaseFreeRunning, SurfaceReason::kPoseMissing}) {
    const UseVerdicts verdict = verdicts(reason, {feature_within(1.0)});
    EXPECT_EQ(state_for(SurfaceUse::kDisplay, verdict), SurfaceState::kGood);
    EXPECT_EQ(state_for(SurfaceUse::kMeasure, verdict), SurfaceState::kDegraded);
    EXPECT_EQ(state_for(SurfaceUse::kDisplay, verdicts(reason, {feature_within(6.0)})), SurfaceState::kDegraded);
  }
}

TEST(SurfaceUse, WhatNoCovarianceTellsIsGoodForNothing) {
  for (const SurfaceReason reason :
       {SurfaceReason::kOrganOrTrackerMoved, SurfaceReason::kSetupDoubted, SurfaceReason::kNotSeen,
        SurfaceReason::kRespirationUnknown, SurfaceReason::kEctopicBeat, SurfaceReason::kPictureRepeated}) {
    for (const UseVerdict& verdict : verdicts(reason, {feature_within(1.0)})) {
      EXPECT_EQ(verdict.state, SurfaceState::kDegraded);
    }
  }
  for (const UseVerdict& verdict : verdicts(SurfaceReason::kNothingMapped, {feature_within(1.0)})) {
    EXPECT_EQ(verdict.state, SurfaceState::kInvalid);
  }
}

}  // namespace
}  // namespace perimap

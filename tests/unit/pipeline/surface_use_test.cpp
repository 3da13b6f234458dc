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

UseVerdicts verdicts(SurfaceState state, bool accounted_for, const std::vector<SurfaceFeature>& features) {
  return verdicts_by_use(state, accounted_for, features, kBounds);
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
  const UseVerdicts verdict = verdicts(SurfaceState::kGood, true, {feature_within(2.5), feature_within(2.7)});
  EXPECT_EQ(state_for(SurfaceUse::kDisplay, verdict), SurfaceState::kGood);
  EXPECT_EQ(state_for(SurfaceUse::kMeasure, verdict), SurfaceState::kGood);
  EXPECT_EQ(state_for(SurfaceUse::kContact, verdict), SurfaceState::kDegraded);
  EXPECT_EQ(verdict[1].features, 2U);
  EXPECT_EQ(verdict[2].features, 0U);
}

TEST(SurfaceUse, HalfOfTheConvergedFeaturesAreEnoughAndFewerAreNot) {
  const SurfaceFeature sure = feature_within(1.5), unsure = feature_within(2.5);
  EXPECT_EQ(state_for(SurfaceUse::kContact, verdicts(SurfaceState::kGood, true, {sure, unsure})), SurfaceState::kGood);
  EXPECT_EQ(state_for(SurfaceUse::kContact, verdicts(SurfaceState::kGood, true, {sure, unsure, unsure})),
            SurfaceState::kDegraded);
  const SurfaceFeature starting = feature_within(1.5, FeatureState::kConverging);
  EXPECT_EQ(state_for(SurfaceUse::kDisplay, verdicts(SurfaceState::kGood, true, {starting})), SurfaceState::kDegraded)
      << "what has not converged does not count";
}

TEST(SurfaceUse, WhatItsCovariancesAccountForMayBeShownAsFarAsTheySayAndNoMore) {
  const UseVerdicts verdict = verdicts(SurfaceState::kDegraded, true, {feature_within(1.0)});
  EXPECT_EQ(state_for(SurfaceUse::kDisplay, verdict), SurfaceState::kGood);
  EXPECT_EQ(state_for(SurfaceUse::kMeasure, verdict), SurfaceState::kDegraded);
  EXPECT_EQ(state_for(SurfaceUse::kDisplay, verdicts(SurfaceState::kDegraded, true, {feature_within(6.0)})),
            SurfaceState::kDegraded);
}

TEST(SurfaceUse, WhatNoCovarianceTellsIsGoodForNothing) {
  for (const UseVerdict& verdict : verdicts(SurfaceState::kDegraded, false, {feature_within(1.0)})) {
    EXPECT_EQ(verdict.state, SurfaceState::kDegraded);
  }
  for (const UseVerdict& verdict : verdicts(SurfaceState::kInvalid, false, {feature_within(1.0)})) {
    EXPECT_EQ(verdict.state, SurfaceState::kInvalid);
  }
}

}  // namespace
}  // namespace perimap

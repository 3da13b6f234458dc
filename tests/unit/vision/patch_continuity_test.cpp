#include "core/vision/patch_continuity.hpp"

#include <gtest/gtest.h>

namespace perimap {
namespace {

PatchState in_shape(double xx, double xy, double yx, double yy) {
  PatchState state;
  state.A << xx, xy, yx, yy;
  return state;
}

PatchContinuity usually(double correlation) {
  PatchContinuity looks;
  for (int i = 0; i < 50; ++i) looks.add(correlation);
  return looks;
}

TEST(PatchContinuity, BeforeTheFirstMatchAnythingIsPlausible) {
  EXPECT_TRUE(PatchContinuity().is_plausible(PatchState(), in_shape(2, 0, 0, 1), 0.88, 1));
}

TEST(PatchContinuity, WhatFitsFarWorseThanUsualIsSomethingElse) {
  const PatchContinuity clear = usually(0.998), blurred = usually(0.95);
  EXPECT_TRUE(clear.is_plausible(PatchState(), PatchState(), 0.98, 1));
  EXPECT_FALSE(clear.is_plausible(PatchState(), PatchState(), 0.93, 1));
  EXPECT_TRUE(blurred.is_plausible(PatchState(), PatchState(), 0.88, 1));
}

TEST(PatchContinuity, AFitMayGetWorseLittleByLittle) {
  PatchContinuity looks = usually(0.998);
  for (double correlation = 0.998; correlation > 0.9; correlation -= 0.002) {
    ASSERT_TRUE(looks.is_plausible(PatchState(), PatchState(), correlation, 1)) << correlation;
    looks.add(correlation);
  }
}

TEST(PatchContinuity, ShapesTurnIntoEachOtherOverSomeFramesOnly) {
  const PatchContinuity looks = usually(0.998);
  const PatchState before = in_shape(0.8, 0, 0, 1.05), turned = in_shape(0.4, -0.42, 0.34, 1.04);
  EXPECT_TRUE(looks.is_plausible(before, in_shape(0.72, 0.05, 0, 1.0), 0.995, 1));
  EXPECT_FALSE(looks.is_plausible(before, turned, 0.995, 1));
  EXPECT_FALSE(looks.is_plausible(before, in_shape(1.15, 0, 0, 1.05), 0.995, 1));
  EXPECT_TRUE(looks.is_plausible(before, in_shape(1.15, 0, 0, 1.05), 0.995, 3));
}

TEST(PatchContinuity, ANewTemplateBeginsAnew) {
  PatchContinuity looks = usually(0.998);
  looks.reset();
  EXPECT_TRUE(looks.is_plausible(PatchState(), PatchState(), 0.9, 1));
}

}  // namespace
}  // namespace perimap

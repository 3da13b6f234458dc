#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

#include "core/vision/patch_tracker.hpp"
#include "core/vision/way_back.hpp"
#include "tests/unit/vision/synthetic_scene.hpp"

namespace perimap {
namespace {

using test::render;
using test::Texture;

// A feature that is followed from frame to frame takes each template from a picture that is as noisy as the next one.
// Whatever that noise moves a match by, always the same way, adds up from frame to frame: so it must move it by
// nothing.
//
// Twenty patches of faint texture on a slope of brightness, each matched in many pairs of noisy pictures of one view.
// If the errors of a patch have a mean of zero, the mean's square in units of its covariance has an expectation of two.
TEST(NoisyTemplate, DoesNotMoveAgainstItsSlope) {
  constexpr int kSide = 64, kPatches = 20, kPairs = 80;
  constexpr double kNoise_grey = 6;
  const Vector2d px(31.3, 32.2);
  const PatchTracker tracker({.min_correlation = 0.3});
  std::mt19937 random(20260311);
  double sum_of_squares = 0;
  for (unsigned seed = 0; seed < kPatches; ++seed) {
    const Texture texture(seed, 18, 18, 160);
    Vector2d sum = Vector2d::Zero();
    Matrix2d squares = Matrix2d::Zero();
    int matches = 0;
    for (int pair = 0; pair < kPairs; ++pair) {
      const test::ImageBuffer before = render(texture, {}, kSide, kSide, kNoise_grey, random);
      const test::ImageBuffer after = render(texture, {}, kSide, kSide, kNoise_grey, random);
      PatchTemplate view;
      ASSERT_TRUE(make_view(before.view(), px, tracker.kernels(), view));
      PatchState state;
      const PatchMatch match = tracker.track(after.view(), view, state, px, test::isotropic(1));
      if (match.state != MatchState::kFound) continue;
      const Vector2d error = match.px - px;
      sum += error;
      squares += error * error.transpose();
      ++matches;
    }
    ASSERT_GE(matches, kPairs * 9 / 10) << seed;
    const Vector2d mean = sum / matches;
    const Matrix2d covariance = (squares / matches - mean * mean.transpose()) / (matches - 1);
    sum_of_squares += mean.dot(covariance.inverse() * mean);
  }
  // Of chi squared with forty degrees of freedom: four deviations above its mean.
  EXPECT_LT(sum_of_squares, 40 + 4 * 9);
}

}  // namespace
}  // namespace perimap

#include "core/vision/patch_tracker.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/vision/synthetic_scene.hpp"

namespace perimap {
namespace {

using test::ImageBuffer;
using test::isotropic;
using test::median;
using test::render;
using test::Texture;
using test::View;

constexpr int kWidth = 161, kHeight = 123;  // odd on purpose
constexpr double kNoise = 2;                // grey levels

Matrix2d affine(double xx, double xy, double yx, double yy) {
  Matrix2d A;
  A << xx, xy, yx, yy;
  return A;
}

// A feature of one seeded texture, its template from a first view with the feature at `anchor`.
class Trial {
 public:
  explicit Trial(unsigned seed, double noise = kNoise, Texture texture = Texture(5),
                 const Vector2d& anchor = Vector2d(80.3, 61.8))
      : random_(seed), noise_(noise), texture_(std::move(texture)), anchor_(anchor) {
    std::uniform_real_distribution<double> place(-500, 500);
    point_ = Vector2d(place(random_), place(random_));
    View first;
    first.t = anchor - point_;
    show(first);
    verdict = make_patch_template(image_.view(), anchor, TemplateSettings{}, PatchTracker().kernels(), patch);
  }

  // The view in which the feature appears at px under the warp A.
  [[nodiscard]] View view_with(const Vector2d& px, const Matrix2d& A = Matrix2d::Identity()) const {
    View view;
    view.A = A;
    view.t = px - A * point_;
    return view;
  }

  void show(const View& view) { image_ = render(texture_, view, kWidth, kHeight, noise_, random_, 3); }
  void show_other_texture(const Texture& other, const View& view) {
    image_ = render(other, view, kWidth, kHeight, noise_, random_, 3);
  }

  PatchMatch track(const Vector2d& predicted, const Matrix2d& covariance, const PatchTrackerSettings& settings = {}) {
    return PatchTracker(settings).track(image_.view(), patch, state, predicted, covariance);
  }
  double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }
  ImageBuffer& image() { return image_; }

  TemplateVerdict verdict;
  PatchTemplate patch;
  PatchState state;

 private:
  std::mt19937 random_;
  double noise_;
  Texture texture_;
  Vector2d anchor_, point_;
  ImageBuffer image_{1, 1};
};

TEST(PatchTracker, FindsTheFeatureToATenthOfAPixelUnderNoiseLightChangeAndWarp) {
  std::vector<double> errors;
  for (unsigned seed = 0; seed < 60; ++seed) {
    Trial trial(seed);
    if (trial.verdict != TemplateVerdict::kGood) continue;
    const Vector2d px(80 + trial.uniform(-6, 6), 60 + trial.uniform(-6, 6));
    const auto small = [&trial] { return trial.uniform(-0.08, 0.08); };
    View view = trial.view_with(px, affine(1 + small(), small(), small(), 1 + small()));
    view.gain = trial.uniform(0.94, 1.06);
    view.bias = trial.uniform(-4, 4);
    trial.show(view);
    const PatchMatch match =
        trial.track(px + Vector2d(trial.uniform(-1.5, 1.5), trial.uniform(-1.5, 1.5)), isotropic(1.5));
    ASSERT_EQ(match.state, MatchState::kFound) << "seed " << seed;
    EXPECT_GT(match.correlation, 0.95);
    EXPECT_NEAR(trial.state.gain, view.gain, 0.1);  // interpolation flattens a little
    EXPECT_LT((trial.state.A - view.A).cwiseAbs().maxCoeff(), 0.03);
    errors.push_back((match.px - px).norm());
  }
  ASSERT_GE(errors.size(), 50U);
  EXPECT_LT(median(errors), 0.06);
  EXPECT_LT(*std::max_element(errors.begin(), errors.end()), 0.25);
}

// The template is as smooth as what it is held against: with bilinear interpolation, which blurs by where between
// pixels it is, the affine parameters took the blur for a change of size and moved the feature, here by 0.03 px in the
// median.
TEST(PatchTracker, FineTextureBetweenPixelsMovesNothing) {
  std::vector<double> errors;
  for (unsigned seed = 0; seed < 60; ++seed) {
    constexpr double kLittleNoise = 0.1;
    Trial trial(seed, kLittleNoise, Texture(seed, 22, 2.8, 12), Vector2d(80, 61));
    if (trial.verdict != TemplateVerdict::kGood) continue;
    const Vector2d px(80 + trial.uniform(-3, 3), 61 + trial.uniform(-3, 3));
    trial.show(trial.view_with(px));
    const PatchMatch match = trial.track(px, isotropic(1.5));
    ASSERT_EQ(match.state, MatchState::kFound) << "seed " << seed;
    errors.push_back((match.px - px).norm());
  }
  ASSERT_GE(errors.size(), 50U);
  EXPECT_LT(median(errors), 0.023);
}

TEST(PatchTracker, ReachesFeatures25PixelsFromAWidePrediction) {
  int found = 0, tried = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    Trial trial(seed);
    if (trial.verdict != TemplateVerdict::kGood) continue;
    const double direction = trial.uniform(0, 2 * M_PI);
    const Vector2d px = Vector2d(80, 61) + 25 * Vector2d(std::cos(direction), std::sin(direction));
    trial.show(trial.view_with(px));
    const PatchMatch match = trial.track({80, 61}, isotropic(9));
    ++tried;
    found += match.state == MatchState::kFound && (match.px - px).norm() < 0.5 ? 1 : 0;
  }
  ASSERT_GE(tried, 30);
  EXPECT_GE(found, tried - 1);
}

TEST(PatchTracker, CapturesFromFourPixelsWithAModeratePrediction) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    Trial trial(seed);
    if (trial.verdict != TemplateVerdict::kGood) continue;
    const double direction = trial.uniform(0, 2 * M_PI);
    const Vector2d px(80.4, 60.7);
    trial.show(trial.view_with(px));
    const PatchMatch match = trial.track(px + 4 * Vector2d(std::cos(direction), std::sin(direction)), isotropic(1.5));
    ASSERT_EQ(match.state, MatchState::kFound) << "seed " << seed;
    EXPECT_LT((match.px - px).norm(), 0.3);
  }
}

TEST(PatchTracker, FollowsGrowingStretchThroughItsState) {
  Trial trial(3);
  ASSERT_EQ(trial.verdict, TemplateVerdict::kGood);
  const Vector2d px(80.2, 61.1);
  for (int step = 1; step <= 20; ++step) {
    const double s = 0.02 * step;
    const Matrix2d A = affine(1 + s, 0.3 * s, -0.5 * s, 1 - 0.3 * s);
    trial.show(trial.view_with(px, A));
    const PatchMatch match = trial.track(px + Vector2d(0.4, -0.5), isotropic(1));
    ASSERT_EQ(match.state, MatchState::kFound) << "step " << step;
    EXPECT_LT((match.px - px).norm(), 0.3) << "step " << step;
    EXPECT_LT((trial.state.A - A).cwiseAbs().maxCoeff(), 0.06);
  }
  EXPECT_FALSE(template_is_stale(PatchState{}));
  trial.state.A = affine(2.1, 0, 0, 1.2);
  EXPECT_TRUE(template_is_stale(trial.state));
  trial.state.A = affine(1, 0, 0, 0.45);
  EXPECT_TRUE(template_is_stale(trial.state));
}

TEST(PatchTracker, SearchesWithTheShapeLastSeen) {
  Trial trial(8);
  ASSERT_EQ(trial.verdict, TemplateVerdict::kGood);
  const Matrix2d A = 1.25 * affine(std::cos(0.5), -std::sin(0.5), std::sin(0.5), std::cos(0.5));
  const Vector2d px(88.2, 52.1);
  trial.show(trial.view_with(px, A));
  trial.state.A = A;
  const PatchMatch match = trial.track({76, 65}, isotropic(6));
  ASSERT_EQ(match.state, MatchState::kFound);
  EXPECT_LT((match.px - px).norm(), 0.3);
}

TEST(PatchTracker, SaysLowCorrelationOrDivergedWhenThePatchIsCoveredOrAnotherTexture) {
  int accepted = 0;
  for (unsigned seed = 0; seed < 30; ++seed) {
    Trial trial(seed);
    if (trial.verdict != TemplateVerdict::kGood) continue;
    const PatchState before = trial.state;
    trial.show_other_texture(Texture(1000 + seed), trial.view_with({80, 61}));
    const PatchMatch match = trial.track({80, 61}, isotropic(2));
    accepted += match.state == MatchState::kFound ? 1 : 0;
    if (match.state != MatchState::kFound) {
      EXPECT_TRUE(match.state == MatchState::kLowCorrelation || match.state == MatchState::kDiverged ||
                  match.state == MatchState::kTooFar);
      EXPECT_EQ(match.px, Vector2d(80, 61));
      EXPECT_EQ(trial.state.A, before.A);
    }

    trial.show(trial.view_with({80, 61}));
    for (int v = 40; v < 82; ++v) {
      for (int u = 60; u < 84; ++u) trial.image().at(u, v) = 90;  // an instrument's edge over most of it
    }
    EXPECT_NE(trial.track({80, 61}, isotropic(0.5)).state, MatchState::kFound);
    for (std::uint8_t& pixel : trial.image().pixels) pixel = 77;
    EXPECT_EQ(trial.track({80, 61}, isotropic(3)).state, MatchState::kLowCorrelation);
  }
  EXPECT_LE(accepted, 1);
}

TEST(PatchTracker, SaysOutOfViewAtEveryEdge) {
  Trial trial(4);
  ASSERT_EQ(trial.verdict, TemplateVerdict::kGood);
  trial.show(trial.view_with({80, 61}));
  for (const Vector2d& px : {Vector2d(5, 60), Vector2d(80, 4), Vector2d(157, 60), Vector2d(80, 119), Vector2d(-3, -3),
                             Vector2d(1e9, 60), Vector2d(80, -1e300)}) {
    EXPECT_EQ(trial.track(px, isotropic(0.7)).state, MatchState::kOutOfView) << px.transpose();
  }
}

TEST(PatchTracker, StaysInsideTheFrameWhereverTheFeatureIsSought) {
  Trial trial(4);
  ASSERT_EQ(trial.verdict, TemplateVerdict::kGood);
  trial.show(trial.view_with({80, 61}));
  for (double sigma : {0.3, 1.2, 4.0, 12.0, 1e5}) {
    for (int v = -30; v < kHeight + 30; v += 5) {
      for (int u = -30; u < kWidth + 30; u += 5) {
        trial.state.A = affine(1 + 0.01 * (u % 40), 0.1, -0.2, 1.2);
        const PatchMatch match = trial.track(Vector2d(u + 0.5, v + 0.25), isotropic(sigma));
        if (match.state != MatchState::kFound) continue;
        EXPECT_TRUE(match.px.x() > 0 && match.px.x() < kWidth && match.px.y() > 0 && match.px.y() < kHeight);
      }
    }
  }
}

TEST(PatchTracker, SaysTooFarWhenTheGateExcludesWhatWasFound) {
  Trial trial(6);
  ASSERT_EQ(trial.verdict, TemplateVerdict::kGood);
  const Vector2d px(80.1, 61.4);
  trial.show(trial.view_with(px));
  const PatchMatch match = trial.track(px + Vector2d(2.2, 0), isotropic(0.4));
  EXPECT_EQ(match.state, MatchState::kTooFar);
  EXPECT_NEAR(match.px.x(), px.x(), 0.2);
}

TEST(PatchTracker, SaysInvalidInputForWhatIsNoPrediction) {
  Trial trial(6);
  ASSERT_EQ(trial.verdict, TemplateVerdict::kGood);
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(trial.track({nan, 60}, isotropic(1)).state, MatchState::kInvalidInput);
  EXPECT_EQ(trial.track({80, inf}, isotropic(1)).state, MatchState::kInvalidInput);
  EXPECT_EQ(trial.track({80, 60}, isotropic(nan)).state, MatchState::kInvalidInput);
  EXPECT_EQ(trial.track({80, 60}, isotropic(inf)).state, MatchState::kInvalidInput);
  EXPECT_EQ(trial.track({80, 60}, affine(1, 2, 2, 1)).state, MatchState::kInvalidInput);
  EXPECT_EQ(trial.track({80, 60}, affine(0, 0, 0, 0)).state, MatchState::kInvalidInput);
  trial.state.A(0, 1) = nan;
  EXPECT_EQ(trial.track({80, 60}, isotropic(1)).state, MatchState::kInvalidInput);
  trial.state.A = affine(1, 1, 1, 1);
  EXPECT_EQ(trial.track({80, 60}, isotropic(1)).state, MatchState::kInvalidInput);
}

TEST(PatchTracker, CovarianceMatchesTheScatterOfSeededTrials) {
  // Weak texture under strong noise, and no floor that would hide it.
  PatchTrackerSettings settings;
  settings.sigma_floor_px = 0;
  settings.min_correlation = 0.3;
  constexpr double kStrongNoise = 3;
  double normalised = 0;
  int count = 0;
  for (unsigned seed = 0; seed < 120; ++seed) {
    Trial trial(seed, kStrongNoise, Texture(5, 14, 12, 60));
    if (trial.verdict != TemplateVerdict::kGood) continue;
    const Vector2d px(80 + trial.uniform(-1, 1), 61 + trial.uniform(-1, 1));
    trial.show(trial.view_with(px, affine(1.1, 0.1, 0, 0.95)));
    trial.state.A = affine(1.1, 0.1, 0, 0.95);
    const PatchMatch match = trial.track(px, isotropic(1), settings);
    if (match.state != MatchState::kFound) continue;
    const Vector2d e = match.px - px;
    normalised += 0.5 * e.dot(match.covariance_px2.inverse() * e);
    ++count;
  }
  ASSERT_GE(count, 80);
  EXPECT_GT(normalised / count, 0.5);
  EXPECT_LT(normalised / count, 2.0);
}

TEST(PatchTracker, CovarianceIsNeverBelowItsFloor) {
  Trial trial(2, 0);
  ASSERT_EQ(trial.verdict, TemplateVerdict::kGood);
  trial.show(trial.view_with({80.3, 61.8}));
  const PatchMatch match = trial.track({80, 61}, isotropic(1));
  ASSERT_EQ(match.state, MatchState::kFound);
  const double floor = PatchTrackerSettings{}.sigma_floor_px;
  EXPECT_GE(match.covariance_px2(0, 0), floor * floor);
  EXPECT_GE(match.covariance_px2(1, 1), floor * floor);
}

TEST(PatchTracker, GivesTheSameBitsEachTime) {
  Trial trial(9);
  ASSERT_EQ(trial.verdict, TemplateVerdict::kGood);
  trial.show(trial.view_with({84.3, 58.8}, affine(1.05, 0.02, 0.01, 0.97)));
  const PatchState start = trial.state;
  const PatchMatch first = trial.track({80, 61}, isotropic(3));
  const PatchState after = trial.state;
  trial.state = start;
  const PatchMatch second = trial.track({80, 61}, isotropic(3));
  EXPECT_EQ(first.state, MatchState::kFound);
  EXPECT_EQ(first.px, second.px);
  EXPECT_EQ(first.covariance_px2, second.covariance_px2);
  EXPECT_EQ(after.A, trial.state.A);
}

TEST(PatchTracker, GivesTheSameBitsOnEveryInstructionSet) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    Trial trial(seed);
    if (trial.verdict != TemplateVerdict::kGood) continue;
    trial.show(trial.view_with({84.3, 58.8}, affine(1.05, 0.02, 0.01, 0.97)));
    std::vector<PatchMatch> matches;
    std::vector<PatchState> states;
    for (const SimdTarget target : simd_targets()) {
      for (const double sigma_px : {0.5, 1.2, 6.0}) {
        PatchState state;
        state.A = affine(1.01, 0, 0.02, 0.99);
        const Vector2d predicted = Vector2d(84.3, 58.8) + Vector2d(sigma_px, -0.5 * sigma_px);
        const PatchTracker tracker(PatchTrackerSettings{}, target);
        matches.push_back(tracker.track(trial.image().view(), trial.patch, state, predicted, isotropic(sigma_px)));
        states.push_back(state);
      }
    }
    for (std::size_t i = 3; i < matches.size(); ++i) {
      EXPECT_EQ(matches[i].state, matches[i % 3].state);
      EXPECT_EQ(matches[i].px, matches[i % 3].px);
      EXPECT_EQ(matches[i].covariance_px2, matches[i % 3].covariance_px2);
      EXPECT_EQ(states[i].A, states[i % 3].A);
    }
  }
}

}  // namespace
}  // namespace perimap

#include "core/pipeline/feature_stages.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>

#include "tests/unit/vision/synthetic_scene.hpp"

namespace perimap {
namespace {

// One candidate, followed from frame to frame in a still texture that the test shifts; eight features around it, of
// which only the motion is told. No map, no pose.
struct Candidate : ::testing::Test {
  static constexpr int kWidth = 240, kHeight = 200;
  const Vector2d start{120, 100};

  test::Texture texture{5};
  std::mt19937 random{1};
  PipelineSettings settings;
  PixelModel model;
  PatchTracker tracker;
  std::unique_ptr<FrameHistory> history = std::make_unique<FrameHistory>(BasisLayout{2, 0});
  NeighbourMotion motion{8};
  FrameJob job;
  FeatureSlot slot;
  Vector2d shift = Vector2d::Zero();

  Candidate() {
    settings.camera = {kWidth, kHeight, 500, 500, 120, 100, 0, 0, 0, 0, 0};
    model.camera = settings.camera;
    const test::ImageBuffer image = view(shift);
    EXPECT_EQ(make_patch_template(image.view(), start, TemplateSettings{}, tracker.kernels(), slot.patch),
              TemplateVerdict::kGood);
    slot.state = SlotState::kTracked;
    slot.patch_state.px = slot.carried_px = start;
    slot.looks.add(1);
    history->append({});
    job.history = history.get();
    job.tracker = &tracker;
    job.motion = &motion;
  }

  test::ImageBuffer view(const Vector2d& at) {
    test::View view;
    view.t = at;
    return test::render(texture, view, kWidth, kHeight, 1, random);
  }
  [[nodiscard]] Vector2d place() const { return start + shift; }

  // The picture, and what is around the feature, move so far; `image` is what is seen of it.
  void next_frame(const Vector2d& by, const test::ImageBuffer& image) {
    job.frame = &history->append({});
    job.image = image.view();
    motion.clear();
    for (int i = 0; i < 8; ++i) {
      const Vector2d from = place() + Vector2d(10 * i - 40, 20);
      motion.add(from, from + by);
    }
    shift += by;
    predict_and_find(slot, {}, job, model, settings);
    settle_match(slot, {}, job, model, settings);
  }
  void next_frame(const Vector2d& by) {
    const test::ImageBuffer image = view(shift + by);
    next_frame(by, image);
  }
  void covered_frame(const Vector2d& by) { next_frame(by, test::ImageBuffer(kWidth, kHeight)); }

  [[nodiscard]] bool is_found() const {
    return slot.match.state == MatchState::kFound && (slot.match.px - place()).norm() < 0.5;
  }
};

TEST_F(Candidate, IsFollowed) {
  for (int i = 0; i < 5; ++i) {
    next_frame({4, -2});
    ASSERT_TRUE(is_found()) << i;
  }
  EXPECT_NEAR(slot.velocity_px.x(), 4, 0.5);
}

TEST_F(Candidate, ThatMovesFurtherThanItsOwnVelocityTellsIsFoundWhereItsNeighboursAre) {
  next_frame({2, 0});
  next_frame({48, 20});
  EXPECT_TRUE(is_found());
}

TEST_F(Candidate, ThatWasCoveredIsCarriedAlongAndFoundAgain) {
  next_frame({2, 0});
  for (int i = 0; i < 10; ++i) {
    covered_frame({5, 2});
    ASSERT_NE(slot.match.state, MatchState::kFound);
  }
  next_frame({5, 2});
  EXPECT_TRUE(is_found());
  EXPECT_EQ(slot.last_found_frame, job.frame->index);
}

TEST_F(Candidate, ThatGoesAnotherWayThanItsNeighboursIsNotBelieved) {
  next_frame({2, 0});
  const Vector2d before = slot.patch_state.px;
  // What it follows moves on its own: an instrument, a highlight.
  const test::ImageBuffer image = view(shift + Vector2d(-18, 0));
  next_frame({8, 0}, image);
  EXPECT_NE(slot.match.state, MatchState::kFound);
  EXPECT_EQ(slot.patch_state.px, before) << "nothing is taken from it";
  EXPECT_NEAR((slot.carried_px - place()).norm(), 0, 0.5);
}

TEST_F(Candidate, WithoutNeighboursIsBelievedWhereItsOwnMotionLeads) {
  next_frame({2, 0});
  const test::ImageBuffer image = view(shift + Vector2d(-18, 0));
  job.frame = &history->append({});
  job.image = image.view();
  motion.clear();
  shift += Vector2d(-18, 0);
  predict_and_find(slot, {}, job, model, settings);
  settle_match(slot, {}, job, model, settings);
  EXPECT_TRUE(is_found());
}

TEST_F(Candidate, SeenFarLargerGetsAFreshTemplateWhereThePictureHasOne) {
  test::View larger;
  larger.A = 2.1 * Matrix2d::Identity();
  larger.t = start - larger.A * start;
  const test::ImageBuffer image = test::render(texture, larger, kWidth, kHeight, 1, random);
  slot.patch_state.A = larger.A;
  job.templates.min_texture = 1e6;  // no picture has so much
  for (int i = 0; i < 70; ++i) next_frame({0, 0}, image);
  ASSERT_TRUE(is_found());
  EXPECT_NEAR(slot.patch_state.A(0, 0), 2.1, 0.1);
  job.templates.min_texture = 0.5;
  for (int i = 0; i < 70; ++i) next_frame({0, 0}, image);
  ASSERT_TRUE(is_found());
  EXPECT_NEAR(slot.patch_state.A(0, 0), 1.0, 0.1);
}

// Tissue that is wetted, or lit from elsewhere: it fades into another one, and both move alike.
struct ChangingLooks : Candidate {
  test::Texture other{9};
  PatchTracker view_tracker = LastView::tracker();
  std::unique_ptr<test::ImageBuffer> before;

  ChangingLooks() { job.view_tracker = &view_tracker; }

  std::unique_ptr<test::ImageBuffer> look(double share, const Vector2d& at) {
    test::View moved;
    moved.t = at;
    auto image = std::make_unique<test::ImageBuffer>(view(at));
    test::ImageBuffer faded = test::render(other, moved, kWidth, kHeight, 1, random);
    for (std::size_t i = 0; i < image->pixels.size(); ++i) {
      const double grey = (1 - share) * image->pixels[i] + share * faded.pixels[i];
      image->pixels[i] = static_cast<std::uint8_t>(std::lround(grey));
    }
    return image;
  }
  void next_look(double share, const Vector2d& by) {
    auto image = look(share, shift + by);
    job.before = before != nullptr ? before->view() : GreyImage{};
    next_frame(by, *image);
    before = std::move(image);
  }
};

TEST_F(ChangingLooks, AreFollowedFromTheFrameBeforeAndTheDriftIsTold) {
  constexpr int kFrames = 30;
  double deviation_px = 0;
  for (int i = 0; i <= kFrames; ++i) {
    next_look(static_cast<double>(i) / kFrames, {1.5, -0.5});
    ASSERT_EQ(slot.match.state, MatchState::kFound) << i;
    ASSERT_LT((slot.match.px - place()).norm(), 1.5) << i;
    if (slot.seen_by_last_view) {
      EXPECT_GT(slot.match.covariance_px2(0, 0), deviation_px * deviation_px) << "it drifts on";
      deviation_px = std::sqrt(slot.last_view.drift_px2());
    }
  }
  EXPECT_TRUE(slot.seen_by_last_view) << "the first view should not fit what it has become";
  EXPECT_GT(deviation_px, 0.1);
  // It is as it was.
  for (int i = kFrames; i >= 0; --i) next_look(static_cast<double>(i) / kFrames, {-1.5, 0.5});
  EXPECT_TRUE(is_found());
  EXPECT_FALSE(slot.seen_by_last_view);
  EXPECT_EQ(slot.last_view.drift_px2(), 0);
}

// What is around the feature moves by so little on the whole, and each otherwise, that a look-alike might have moved
// so.
TEST_F(ChangingLooks, AreNotMistakenForWhatLooksMoreLikeTheFirstViewBesideIt) {
  constexpr double kShare = 0.33, kLessFaded = 0.3, kAway_px = 24;
  constexpr int kFrames = 10, kHalf = 12;
  for (int i = 0; i <= kFrames; ++i) next_look(kShare * i / kFrames, {0, 0});
  ASSERT_TRUE(is_found());
  ASSERT_FALSE(slot.seen_by_last_view);

  auto image = look(kShare, shift);
  test::ImageBuffer like = *look(kLessFaded, shift);
  const int u = static_cast<int>(place().x()), v = static_cast<int>(place().y());
  for (int y = -kHalf; y <= kHalf; ++y) {
    for (int x = -kHalf; x <= kHalf; ++x) image->at(u + static_cast<int>(kAway_px) + x, v + y) = like.at(u + x, v + y);
  }
  slot.velocity_px = {kAway_px, 0};
  job.before = before->view();
  job.frame = &history->append({});
  job.image = image->view();
  motion.clear();
  for (int i = 0; i < 8; ++i) {
    const Vector2d from = place() + Vector2d(10 * i - 40, 20);
    motion.add(from, from + 7.5 * Vector2d(std::cos(M_PI_2 * i), std::sin(M_PI_2 * i)));
  }
  predict_and_find(slot, {}, job, model, settings);
  ASSERT_NEAR(slot.match.px.x(), place().x() + kAway_px, 1) << "the first view should have found the other place";
  settle_match(slot, {}, job, model, settings);
  EXPECT_EQ(slot.match.state, MatchState::kFound);
  EXPECT_LT((slot.match.px - place()).norm(), 1);
  EXPECT_TRUE(slot.seen_by_last_view);
}

TEST_F(ChangingLooks, AreFollowedOnAndNotLearntFromOnceTheyHaveDriftedByAPixel) {
  constexpr int kFrames = 30;
  const auto hold = [this] {
    FrameRecord told = *job.frame;
    told.measurable = told.held = true;
    job.frame = &told;
    slot.held.drop(slot.held.size());
    hold_match(slot, job);
    job.frame = history->newest();
    return slot.held.size();
  };
  for (int i = 0; i <= kFrames; ++i) next_look(static_cast<double>(i) / kFrames, {1, 0});
  ASSERT_TRUE(slot.seen_by_last_view);
  EXPECT_EQ(hold(), 1);
  EXPECT_EQ(slot.last_told_frame, job.frame->index);

  PatchMatch far_off;
  far_off.covariance_px2 = 1.5 * Matrix2d::Identity();
  slot.last_view.drift_to(far_off);
  next_look(1, {1, 0});
  EXPECT_EQ(slot.match.state, MatchState::kFound);
  EXPECT_LT((slot.match.px - place()).norm(), 1.5);
  EXPECT_FALSE(slot.match_agrees);
  EXPECT_EQ(hold(), 0);
  EXPECT_LT(slot.last_told_frame, job.frame->index);
}

TEST_F(ChangingLooks, TeachAMapNothingOnceTheyHaveDriftedByHalfAPixelAndAgreeWithItOnlyNearby) {
  constexpr int kFrames = 30;
  for (int i = 0; i <= kFrames; ++i) next_look(static_cast<double>(i) / kFrames, {1, 0});
  ASSERT_TRUE(slot.seen_by_last_view);
  slot.state = SlotState::kMapped;
  MapPrediction map;
  map.valid = true;
  map.covariance_W = 0.01 * Matrix3d::Identity();
  // Sees it with what it has drifted by, where the map has it so far beside the place that is followed.
  const auto see = [&](double drifted_px, double beside_px) {
    slot.last_view.begin_at(drifted_px * drifted_px);
    const Vector2d by(1, 0);
    shift += by;
    constexpr double kDepth_mm = 500;  // at which a pixel is a mm
    const Vector2d mapped_px = slot.match.px + by + Vector2d(0, beside_px);
    map.p_WF << mapped_px.x() - 120, mapped_px.y() - 100, kDepth_mm;
    auto image = look(1, shift);
    job.before = before->view();
    job.image = image->view();
    FrameRecord& frame = history->append({});
    frame.measurable = frame.held = true;
    frame.stamp.capture = slot.last_observed + std::chrono::milliseconds(33);
    job.frame = &frame;
    motion.clear();
    predict_and_find(slot, map, job, model, settings);
    settle_match(slot, map, job, model, settings);
    before = std::move(image);
    slot.held.clear();
    hold_match(slot, job);
  };
  see(0.2, 2);
  ASSERT_TRUE(slot.seen_by_last_view);
  ASSERT_EQ(slot.match.state, MatchState::kFound);
  EXPECT_TRUE(slot.match_agrees) << slot.match.covariance_px2 << ", " << slot.off_px.transpose();
  EXPECT_EQ(slot.held.size(), 1);
  slot.converged = true;
  see(0.7, 2);
  EXPECT_EQ(slot.match.state, MatchState::kFound);
  EXPECT_FALSE(slot.match_agrees);
  EXPECT_EQ(slot.held.size(), 0);
  EXPECT_EQ(slot.last_told_frame, job.frame->index) << "it is followed on";
  EXPECT_LT(slot.last_observed, job.frame->stamp.capture);
  see(0.7, 0);
  EXPECT_TRUE(slot.match_agrees);
  EXPECT_EQ(slot.held.size(), 0);
  EXPECT_EQ(slot.last_observed, job.frame->stamp.capture) << "it has been seen where the map has it";
  slot.converged = false;
  see(0.7, 0);
  EXPECT_FALSE(slot.match_agrees) << "a young map is off as often as what is loose";
  slot.state = SlotState::kTracked;
  see(0.7, 0);
  EXPECT_EQ(slot.held.size(), 1) << "a start takes it";
}

TEST_F(ChangingLooks, AreNotFollowedWhereTheWayBackEndsElsewhere) {
  next_look(0, {1, 0});
  // All of it has been replaced: nothing of the frame before is there.
  next_look(1, {1, 0});
  EXPECT_NE(slot.match.state, MatchState::kFound);
}

TEST_F(ChangingLooks, AreFoundAgainAsTheyWereWhenTheyWereCovered) {
  constexpr int kFrames = 30;
  for (int i = 0; i <= kFrames; ++i) next_look(static_cast<double>(i) / kFrames, {1, 0});
  ASSERT_TRUE(slot.seen_by_last_view);
  for (int i = 0; i < 5; ++i) {
    auto nothing = std::make_unique<test::ImageBuffer>(kWidth, kHeight);
    job.before = before->view();
    next_frame({1, 0}, *nothing);
    ASSERT_NE(slot.match.state, MatchState::kFound);
    before = std::move(nothing);
  }
  next_look(1, {1, 0});
  EXPECT_EQ(slot.match.state, MatchState::kFound);
  EXPECT_LT((slot.match.px - place()).norm(), 1.5);
}

// A mapped feature that the map has 25 px beside its place, as a pose that is off makes it.
struct MappedFeature : Candidate {
  MapPrediction map;
  const Vector2d mapped_px{105, 100};

  MappedFeature() {
    constexpr double kDepth_mm = 500;  // at which a pixel is a mm
    map.valid = true;
    map.p_WF << mapped_px.x() - 120, mapped_px.y() - 100, kDepth_mm;
    map.covariance_W = 0.01 * Matrix3d::Identity();
    job.shift.known = true;
    job.shift.centre_px = mapped_px;
    job.shift.coefficients.row(0) << 25, 0;
    job.shift.deviation_px = 1;
  }

  void search(const test::ImageBuffer& image) {
    FrameRecord& frame = history->append({});
    frame.measurable = true;
    frame.tracker_variance_mm2 = 64;
    job.frame = &frame;
    job.image = image.view();
    predict_and_find(slot, map, job, model, settings);
  }
};

TEST_F(MappedFeature, IsSoughtWhereTheScoutsHaveIt) {
  shift = {10, 0};
  test::ImageBuffer image = view(shift);
  // Its very like where the map has it.
  test::ImageBuffer like = view(Vector2d::Zero());
  for (int y = -12; y <= 12; ++y) {
    for (int x = -12; x <= 12; ++x) {
      image.at(static_cast<int>(mapped_px.x()) + x, static_cast<int>(mapped_px.y()) + y) =
          like.at(static_cast<int>(start.x()) + x, static_cast<int>(start.y()) + y);
    }
  }
  search(image);
  EXPECT_TRUE(is_found()) << slot.match.px.transpose();
  EXPECT_NEAR(slot.off_px.x(), 25, 0.5);
  EXPECT_GT(slot.pose_deviation_px, 7);
  job.shift.known = false;
  search(image);
  EXPECT_NEAR((slot.match.px - mapped_px).norm(), 0, 0.5);
}

TEST_F(MappedFeature, ThatIsNotThereIsSoughtWhereTheMapHasIt) {
  shift = mapped_px - start;
  search(view(shift));
  EXPECT_TRUE(is_found()) << slot.match.px.transpose();
}

TEST_F(Candidate, WhosePlaceIsHardlyToldIsNotFound) {
  // Contrast as little above the noise as smoke leaves it.
  test::View smoky;
  smoky.gain = 0.04;
  smoky.bias = 110;
  next_frame({0, 0}, test::render(texture, smoky, kWidth, kHeight, 1, random));
  EXPECT_NE(slot.match.state, MatchState::kFound);
}

TEST(Feature, IsCalledConvergedOnlyAsFarAsTheSetUpThatItWasSeenByIsKnown) {
  FeatureSlot slot;
  slot.state = SlotState::kMapped;
  slot.converged = slot.match_agrees = true;
  slot.largest_deviation_mm = 0.5;
  FeatureSnapshot snapshot;
  FrameDoubts doubts;
  doubts.converged_within_mm = 0.6;
  describe(slot, slot.last_observed, doubts, snapshot);
  EXPECT_EQ(snapshot.state, FeatureState::kConverged);
  EXPECT_FALSE(snapshot.held_back);
  for (const double within_mm : {0.4, -1.0}) {
    doubts.converged_within_mm = within_mm;
    describe(slot, slot.last_observed, doubts, snapshot);
    EXPECT_EQ(snapshot.state, FeatureState::kConverging);
    EXPECT_EQ(snapshot.reason, FeatureReason::kDeviationLarge);
    EXPECT_TRUE(snapshot.held_back);
  }
  slot.converged = false;
  describe(slot, slot.last_observed, doubts, snapshot);
  EXPECT_FALSE(snapshot.held_back) << "it is not certain of itself";
}

}  // namespace
}  // namespace perimap

#include "core/pipeline/feature_stages.hpp"

#include <gtest/gtest.h>

#include <memory>

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
    follow(slot, {}, job, model, settings);
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
  follow(slot, {}, job, model, settings);
  EXPECT_TRUE(is_found());
}

TEST_F(Candidate, WhosePlaceIsHardlyToldIsNotFound) {
  // Contrast as little above the noise as smoke leaves it.
  test::View smoky;
  smoky.gain = 0.04;
  smoky.bias = 110;
  next_frame({0, 0}, test::render(texture, smoky, kWidth, kHeight, 1, random));
  EXPECT_NE(slot.match.state, MatchState::kFound);
}

}  // namespace
}  // namespace perimap

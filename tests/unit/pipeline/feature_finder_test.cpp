#include "core/pipeline/feature_finder.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "tests/unit/vision/synthetic_scene.hpp"

namespace perimap {
namespace {

// A still texture, in lockstep, so that a round's result is there when it is due.
struct Finder : ::testing::Test {
  static constexpr int kWidth = 160, kHeight = 120;

  test::Texture texture{5};
  std::mt19937 random{1};
  test::ImageBuffer image = test::render(texture, test::View{}, kWidth, kHeight, 1, random);
  PipelineCounters counters;
  FeatureFinder finder{settings(), counters};
  std::thread housekeeping{[this] { finder.serve(); }};
  std::uint64_t frame = 0;

  Finder() = default;
  Finder(const Finder&) = delete;
  Finder& operator=(const Finder&) = delete;
  ~Finder() override {
    finder.dismiss();
    housekeeping.join();
  }

  static PipelineSettings settings() {
    PipelineSettings s;
    s.camera.width = kWidth;
    s.camera.height = kHeight;
    s.lockstep = true;
    return s;
  }
  // How many are adopted at the next frame.
  std::size_t next_frame() {
    const std::size_t adopted = finder.adopt(frame).size();
    finder.offer(frame++, {}, image.view(), {}, 8);
    return adopted;
  }
  // How many are adopted in so many frames.
  std::size_t adopted_in(int frames) {
    std::size_t adopted = 0;
    for (int i = 0; i < frames; ++i) adopted += next_frame();
    return adopted;
  }
};

TEST_F(Finder, WhatARoundFindsIsAdoptedAtItsFrame) {
  EXPECT_EQ(adopted_in(kFinderDelayFrames), 0U);
  EXPECT_GT(next_frame(), 0U);
}

TEST_F(Finder, ARoundThatIsDiscardedGivesNothingAndTheNextOneDoes) {
  EXPECT_EQ(adopted_in(2), 0U);
  finder.discard_round();
  const int interval = settings().features.detection_interval_frames;
  EXPECT_EQ(adopted_in(interval - 2), 0U);
  EXPECT_GT(adopted_in(kFinderDelayFrames + 1), 0U);
  EXPECT_EQ(counters.adoptions_late.get(), 0U);
}

TEST_F(Finder, DiscardingBetweenRoundsTakesNothingFromTheNext) {
  static_cast<void>(adopted_in(kFinderDelayFrames + 1));
  finder.discard_round();
  EXPECT_GT(adopted_in(settings().features.detection_interval_frames + 1), 0U);
}

}  // namespace
}  // namespace perimap

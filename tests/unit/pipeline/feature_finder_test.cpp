#include "core/pipeline/feature_finder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <thread>
#include <vector>

#include "tests/unit/vision/synthetic_scene.hpp"

namespace perimap {
namespace {

int frames_of(Duration time, const FrameRate& rate = {}) { return static_cast<int>(rate.frames(time)); }

// A still texture, in lockstep, so that a round's result is there when it is due.
struct Still {
  test::Texture texture{5};
  std::mt19937 random{1};
  test::ImageBuffer image;
  PipelineCounters counters;
  FeatureFinder finder;
  std::thread housekeeping{[this] { finder.serve(); }};
  FrameRate rate;
  std::uint64_t frame = 0;
  std::vector<Vector2d> occupied;

  Still(int width, int height)
      : image(test::render(texture, test::View{}, width, height, 1, random)),
        finder(settings(width, height), counters) {}
  Still(const Still&) = delete;
  Still& operator=(const Still&) = delete;
  ~Still() {
    finder.dismiss();
    housekeeping.join();
  }

  static PipelineSettings settings(int width, int height) {
    PipelineSettings s;
    s.camera.width = width;
    s.camera.height = height;
    s.features.maximum = 120;  // so many in each of six bands
    s.lockstep = true;
    return s;
  }
  // Those adopted at the next frame, which are then occupied.
  std::vector<Vector2d> next_frame(const ColourImage& colour, int wanted) {
    std::vector<Vector2d> adopted;
    for (const FoundFeature& found : finder.adopt(frame)) adopted.push_back(found.first_observed_px);
    occupied.insert(occupied.end(), adopted.begin(), adopted.end());
    finder.offer(frame++, {}, rate, image.view(), colour, occupied, wanted);
    return adopted;
  }
};

struct Finder : ::testing::Test {
  static constexpr int kWidth = 160, kHeight = 120;

  Still still{kWidth, kHeight};
  FeatureFinder& finder = still.finder;
  PipelineCounters& counters = still.counters;

  static PipelineSettings settings() { return Still::settings(kWidth, kHeight); }
  // How many are adopted at the next frame.
  std::size_t next_frame(const ColourImage& colour = {}) {
    still.occupied.clear();
    return still.next_frame(colour, 8).size();
  }
  // How many are adopted in so many frames.
  std::size_t adopted_in(int frames) {
    std::size_t adopted = 0;
    for (int i = 0; i < frames; ++i) adopted += next_frame();
    return adopted;
  }
};

TEST_F(Finder, WhatARoundFindsIsAdoptedAtItsFrame) {
  EXPECT_EQ(adopted_in(kFinderFrames), 0U);
  EXPECT_GT(next_frame(), 0U);
}

// The largest variance of a place (px^2) after a round in which tissue turns into another one by such a share.
double largest_place_px2(double faded) {
  constexpr int kWidth = 160, kHeight = 120;
  Still still(kWidth, kHeight);
  const test::ImageBuffer before = still.image;
  const test::ImageBuffer other = test::render(test::Texture{9}, test::View{}, kWidth, kHeight, 1, still.random);
  double largest_px2 = 0.0;
  for (int i = 0; i <= kFinderFrames; ++i) {
    for (const FoundFeature& found : still.finder.adopt(still.frame)) {
      largest_px2 = std::max(largest_px2, found.place_px2);
    }
    const double share = faded * i / kFinderFrames;
    for (std::size_t p = 0; p < before.pixels.size(); ++p) {
      const double grey = (1 - share) * before.pixels[p] + share * other.pixels[p];
      still.image.pixels[p] = static_cast<std::uint8_t>(std::lround(grey));
    }
    still.finder.offer(still.frame++, {}, still.rate, still.image.view(), {}, {}, 8);
  }
  return largest_px2;
}

TEST(FoundFeatures, ThatTheirLastViewHasFollowedSayHowFarTheyMayHaveDrifted) {
  const double by_first_view_px2 = largest_place_px2(0.0);
  EXPECT_GT(by_first_view_px2, 0.0);
  EXPECT_GT(largest_place_px2(0.6), 4 * by_first_view_px2);
}

TEST_F(Finder, ARoundLastsAsLongWhereTheCameraIsFaster) {
  for (const double per_s : {60.0, 120.0, 240.0}) {
    Still fast(kWidth, kHeight);
    fast.rate = FrameRate(per_s);
    const auto stride = static_cast<std::uint64_t>(per_s / FrameRate::kUsual_per_s);
    while (fast.frame <= (kFinderFrames - 1) * stride) EXPECT_TRUE(fast.next_frame({}, 8).empty()) << per_s;
    EXPECT_FALSE(fast.next_frame({}, 8).empty()) << per_s;
  }
}

TEST_F(Finder, ARoundThatIsDiscardedGivesNothingAndTheNextOneDoes) {
  EXPECT_EQ(adopted_in(2), 0U);
  finder.discard_round();
  const int interval = frames_of(settings().features.detection_interval);
  EXPECT_EQ(adopted_in(interval - 2), 0U);
  EXPECT_GT(adopted_in(kFinderFrames + 1), 0U);
  EXPECT_EQ(counters.adoptions_late.get(), 0U);
}

TEST_F(Finder, DiscardingBetweenRoundsTakesNothingFromTheNext) {
  static_cast<void>(adopted_in(kFinderFrames + 1));
  finder.discard_round();
  EXPECT_GT(adopted_in(frames_of(settings().features.detection_interval) + 1), 0U);
}

// What is grey between columns 40 and 100 of tissue, above row kLower.
struct ColouredFinder : Finder {
  static constexpr int kColourWidth = reduced_side(kWidth), kColourHeight = reduced_side(kHeight);
  static constexpr int kLower = 60;
  std::vector<std::uint8_t> bgr;
  ColourImage colour;

  ColouredFinder() {
    for (int y = 0; y < kColourHeight; ++y) {
      for (int x = 0; x < kColourWidth; ++x) {
        const bool instrument = x >= 10 && x < 25 && y < kLower / kColourReduction;
        for (const int value : instrument ? std::array{120, 122, 125} : std::array{70, 80, 180}) {
          bgr.push_back(static_cast<std::uint8_t>(value));
        }
      }
    }
    colour = {bgr.data(), kColourWidth, kColourHeight, std::ptrdiff_t{3} * kColourWidth};
  }
};

TEST_F(ColouredFinder, FindsNothingOnInstruments) {
  // As far as templates reach onto it.
  const auto is_on_it = [](const Vector2d& px) { return px.x() >= 30 && px.x() < 110 && px.y() < kLower + 10; };
  std::size_t beside = 0, below = 0;
  for (int i = 0; i < 60; ++i) {
    for (const Vector2d& px : still.next_frame(colour, 40)) {
      EXPECT_FALSE(is_on_it(px)) << px.transpose();
      ++beside;
      below += px.x() >= 40 && px.x() < 100 ? 1 : 0;
    }
  }
  EXPECT_GE(beside, 4U);
  EXPECT_GE(below, 1U);
  // As many more lie there, when nothing tells that it is an instrument.
  std::size_t on_it = 0;
  for (int i = 0; i < 120; ++i) {
    for (const Vector2d& px : still.next_frame({}, 40)) {
      on_it += is_on_it(px) ? 1 : 0;
    }
  }
  EXPECT_GE(on_it, 4U);
}

TEST_F(ColouredFinder, BeginsARoundAtAFrameWithColourWhereThereAreAny) {
  // Of the first frame, and then of every seventh.
  const int interval = frames_of(settings().features.detection_interval);
  const auto colour_of = [&](std::uint64_t frame) { return frame % 7 == 0 ? colour : ColourImage{}; };
  std::vector<std::uint64_t> adopted_at;
  while (still.frame < 4 * static_cast<std::uint64_t>(interval)) {
    const std::uint64_t frame = still.frame;
    if (next_frame(colour_of(frame)) > 0) adopted_at.push_back(frame);
  }
  ASSERT_GE(adopted_at.size(), 2U);
  for (const std::uint64_t frame : adopted_at) EXPECT_EQ((frame - kFinderFrames) % 7, 0U);
}

// A scope's field stop leaves a round of the picture; what is on its edge goes with the scope.
TEST(FinderOfARoundPicture, FindsNothingWhoseTemplateHasTheEdgeInIt) {
  constexpr int kWidth = 320, kHeight = 240;
  const Vector2d centre(163.0, 117.0);
  constexpr double kRadius = 104.0, kTemplateReach = PatchTemplate::kReach + 1;
  for (const int surround : {0, 8, 24}) {
    Still still(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double passed = std::clamp((kRadius - (Vector2d(x, y) - centre).norm()) / 1.5 + 0.5, 0.0, 1.0);
        auto& grey = still.image.at(x, y);
        grey = static_cast<std::uint8_t>(std::lround(passed * grey + (1.0 - passed) * surround));
      }
    }
    std::size_t found = 0, near_edge = 0;
    while (still.frame < 120) {
      for (const Vector2d& px : still.next_frame({}, 60)) {
        ++found;
        near_edge += (px - centre).norm() > kRadius - kTemplateReach ? 1 : 0;
      }
    }
    EXPECT_EQ(near_edge, 0U) << surround << " grey around it, of " << found;
    EXPECT_GE(found, 30U) << surround << " grey around it";
  }
}

TEST(FinderOfALargePicture, SearchesABandOfItInEachRoundUntilAllHaveTheirShare) {
  constexpr int kWidth = 640, kHeight = 2880;  // six times what is searched at once
  constexpr std::size_t kBands = 6;
  Still still(kWidth, kHeight);
  const auto maximum = static_cast<std::size_t>(Still::settings(kWidth, kHeight).features.maximum);
  std::array<std::size_t, kBands> adopted{};
  while (still.frame < 50) {
    double least = kHeight, most = 0;
    for (const Vector2d& px : still.next_frame({}, static_cast<int>(maximum - still.occupied.size()))) {
      ++adopted[static_cast<std::size_t>(px.y()) * kBands / kHeight];
      least = std::min(least, px.y());
      most = std::max(most, px.y());
    }
    EXPECT_LT(most - least, kHeight / kBands);
  }
  // Nothing is lost here: the first bands would take all places.
  for (const std::size_t band : adopted) EXPECT_EQ(band, maximum / kBands);
}

TEST(FinderOfALargePicture, FillsTheBandThatLosesItsFeaturesRatherThanThoseThatHaveTheirShare) {
  constexpr int kWidth = 640, kHeight = 2880, kBand = kHeight / 6;
  Still still(kWidth, kHeight);
  const auto maximum = static_cast<std::size_t>(Still::settings(kWidth, kHeight).features.maximum);
  std::size_t in_first = 0, elsewhere = 0;
  while (still.frame < 200) {
    for (const Vector2d& px : still.next_frame({}, static_cast<int>(maximum - still.occupied.size()))) {
      ++(px.y() < kBand ? in_first : elsewhere);
    }
    // Where the heart beats.
    if (still.frame > 50) std::erase_if(still.occupied, [](const Vector2d& px) { return px.y() < kBand; });
  }
  EXPECT_EQ(elsewhere, 5 * maximum / 6);
  EXPECT_GT(in_first, 10 * maximum / 6);
}

}  // namespace
}  // namespace perimap

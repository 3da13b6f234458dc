#include "core/time/frame_rate.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <random>

#include "core/sensors/measured_frame_rate.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(FrameRate, AtTheUsualRateDurationsAreTheCountsThatTheyAreStatedFor) {
  const FrameRate usual;
  EXPECT_EQ(usual.frames(milliseconds(167)), 5U);
  EXPECT_EQ(usual.frames(milliseconds(333)), 10U);
  EXPECT_EQ(usual.frames(milliseconds(500)), 15U);
  EXPECT_EQ(usual.frames(milliseconds(1067)), 32U);
  EXPECT_EQ(usual.frames(seconds(2)), 60U);
  EXPECT_EQ(usual.frames(seconds(30)), 900U);
  EXPECT_EQ(usual.of_usual(), 1.0);
}

TEST(FrameRate, FramesLastAsLongAtEveryRateToHalfAFrame) {
  for (const double per_s : {7.5, 15.0, 25.0, 60.0, 120.0, 239.76}) {
    const FrameRate rate(per_s);
    for (const Duration time : {milliseconds(500), milliseconds(2133), milliseconds(30000)}) {
      EXPECT_NEAR(static_cast<double>(rate.frames(time)) / per_s, to_seconds(time), 0.5 / per_s + 1e-12);
    }
    EXPECT_NEAR(rate.of_usual() * per_s, FrameRate::kUsual_per_s, 1e-12);
  }
}

TEST(FrameRate, AnyTimeIsAFrameAtLeast) {
  EXPECT_EQ(FrameRate(15.0).frames(Duration(0)), 1U);
  EXPECT_EQ(FrameRate(15.0).frames(milliseconds(-500)), 1U);
}

TEST(FrameRate, RatesThatNoCameraHasAreTheNearestThatOneMayHave) {
  EXPECT_EQ(FrameRate(0.0).per_s(), 1.0);
  EXPECT_EQ(FrameRate(std::numeric_limits<double>::infinity()).per_s(), 1000.0);
}

// Frames at a rate, with stamps that are off by up to so much.
struct Camera {
  MeasuredFrameRate measured;
  std::mt19937 random{7};
  double t_s = 100.0;

  void run(int frames, double per_s, double jitter_s = 0.0) {
    std::uniform_real_distribution<double> off_s(-jitter_s, jitter_s);
    for (int i = 0; i < frames; ++i) {
      t_s += 1.0 / per_s;
      measured.add(Instant(from_seconds(t_s + off_s(random))));
    }
  }
  [[nodiscard]] double per_s() const { return measured.rate().per_s(); }
};

TEST(MeasuredFrameRate, AboutTheUsualRateItIsExactlyThatWhateverTheStampsJitter) {
  for (const double per_s : {29.0, 29.97, 30.0, 30.3}) {
    Camera camera;
    for (int i = 0; i < 5000; ++i) {
      camera.run(1, per_s, 2e-3);
      ASSERT_EQ(camera.per_s(), FrameRate::kUsual_per_s) << per_s;
    }
  }
}

TEST(MeasuredFrameRate, AnotherRateIsKnownAfterAThirdOfASecondOrLess) {
  for (const double per_s : {60.0, 120.0, 240.0}) {
    Camera camera;
    camera.run(10, per_s, 0.1 / per_s);
    EXPECT_NEAR(camera.per_s(), per_s, 0.1 * per_s);
    camera.run(1000, per_s, 0.1 / per_s);
    EXPECT_NEAR(camera.per_s(), per_s, 0.1 * per_s);
  }
  Camera slow;
  slow.run(9, 15.0);
  EXPECT_NEAR(slow.per_s(), 15.0, 1e-6);
}

TEST(MeasuredFrameRate, ARateThatChangesIsFollowed) {
  Camera camera;
  camera.run(100, 60.0);
  ASSERT_NEAR(camera.per_s(), 60.0, 1e-5);
  camera.run(8, 25.0);
  EXPECT_NEAR(camera.per_s(), 25.0, 1e-5);
}

TEST(MeasuredFrameRate, GapsRepeatsAndFramesOutOfOrderDoNotTellInIt) {
  Camera camera;
  camera.run(50, 60.0);
  const double before = camera.per_s();
  for (int i = 0; i < 30; ++i) {
    camera.t_s += i % 3 == 0 ? 10.0 : 0.0;                                           // the camera was away
    if (i % 3 == 1) camera.measured.add(Instant(from_seconds(camera.t_s)));          // the same frame again
    if (i % 3 == 2) camera.measured.add(Instant(from_seconds(camera.t_s - 0.005)));  // one out of order
    camera.run(6, 60.0);
    ASSERT_EQ(camera.per_s(), before) << i;
  }
}

TEST(MeasuredFrameRate, EverySecondFrameMissingIsHalfTheRate) {
  Camera camera;
  camera.run(50, 60.0);
  camera.run(20, 30.0);
  EXPECT_NEAR(camera.per_s(), 30.0, 1e-5);
}

}  // namespace
}  // namespace perimap

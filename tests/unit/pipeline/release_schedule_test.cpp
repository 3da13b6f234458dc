#include "core/pipeline/release_schedule.hpp"

#include <gtest/gtest.h>

#include "tests/unit/pipeline/stamped_frames.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using test::at_ms;
using test::frame;
using test::kLatency;

// Frames 0 to n-1, 30 ms apart, each released in time.
ReleaseSchedule running(int n) {
  ReleaseSchedule schedule(kLatency);
  for (int i = 0; i < n; ++i) {
    EXPECT_TRUE(schedule.on_frame(frame(static_cast<std::uint64_t>(i), 30 * i)));
    const Release release = schedule.take_release();
    EXPECT_FALSE(release.frame_missing);
    EXPECT_EQ(release.deadline, at_ms(30 * i + 50));
  }
  return schedule;
}

TEST(ReleaseSchedule, HasNothingDueBeforeTheFirstFrame) { EXPECT_FALSE(ReleaseSchedule(kLatency).next().has_value()); }

TEST(ReleaseSchedule, ReleasesEachFrameAtCapturePlusLatency) { running(10); }

TEST(ReleaseSchedule, AJitteringFrameIsReleasedAtItsOwnTime) {
  ReleaseSchedule schedule = running(10);
  ASSERT_TRUE(schedule.on_frame(frame(10, 303)));
  const Release release = schedule.take_release();
  EXPECT_FALSE(release.frame_missing);
  EXPECT_EQ(release.deadline, at_ms(353));
}

TEST(ReleaseSchedule, GoesOnAtTheFittedTimesWhenFramesStop) {
  ReleaseSchedule schedule = running(10);
  for (int k = 0; k < 5; ++k) {
    const Release release = schedule.take_release();
    EXPECT_TRUE(release.frame_missing);
    EXPECT_EQ(release.frame_sequence, static_cast<std::uint64_t>(10 + k));
    EXPECT_EQ(release.deadline, at_ms(300 + 30 * k + 50));
  }
}

TEST(ReleaseSchedule, ADroppedFrameStillGetsItsRelease) {
  ReleaseSchedule schedule = running(10);
  ASSERT_TRUE(schedule.on_frame(frame(11, 330)));
  const Release missing = schedule.take_release();
  EXPECT_TRUE(missing.frame_missing);
  EXPECT_EQ(missing.deadline, at_ms(350));
  const Release next = schedule.take_release();
  EXPECT_FALSE(next.frame_missing);
  EXPECT_EQ(next.frame_sequence, 11U);
}

TEST(ReleaseSchedule, RefusesAFrameThatArrivesAfterItsReleaseTime) {
  ReleaseSchedule schedule = running(10);
  EXPECT_FALSE(schedule.on_frame({10, at_ms(300), at_ms(351)}));
  EXPECT_TRUE(schedule.next()->frame_missing);
}

// 120 frames/s with L = 1 s.
TEST(ReleaseSchedule, HoldsAsManyFramesAsAreUnderwayWithALongLatency) {
  ReleaseSchedule schedule(std::chrono::seconds(1));
  const Duration period = std::chrono::microseconds(8333);
  for (int i = 0; i < 600; ++i) {
    const Instant capture = at_ms(0) + i * period;
    while (schedule.next() && schedule.next()->deadline <= capture + milliseconds(12)) {
      EXPECT_FALSE(schedule.take_release().frame_missing) << i;
    }
    ASSERT_TRUE(schedule.on_frame({static_cast<std::uint64_t>(i), capture, capture + milliseconds(12)})) << i;
  }
}

TEST(ReleaseSchedule, RefusesAFrameWhoseReleaseWasTakenAsMissing) {
  ReleaseSchedule schedule = running(10);
  EXPECT_TRUE(schedule.take_release().frame_missing);
  EXPECT_FALSE(schedule.on_frame(frame(10, 300)));
  ASSERT_TRUE(schedule.on_frame(frame(11, 330)));
  EXPECT_EQ(schedule.take_release().frame_sequence, 11U);
}

TEST(ReleaseSchedule, RefusesAFrameThatGoesBackInTime) {
  ReleaseSchedule schedule = running(10);
  EXPECT_FALSE(schedule.on_frame(frame(3, 90)));
}

TEST(ReleaseSchedule, ResumesWithRealFramesAfterAStop) {
  ReleaseSchedule schedule = running(10);
  for (int k = 0; k < 7; ++k) EXPECT_TRUE(schedule.take_release().frame_missing);
  ASSERT_TRUE(schedule.on_frame(frame(17, 508)));
  const Release release = schedule.take_release();
  EXPECT_FALSE(release.frame_missing);
  EXPECT_EQ(release.deadline, at_ms(558));
}

TEST(ReleaseSchedule, AFrameBehindAMissingOneIsStillPending) {
  ReleaseSchedule schedule = running(10);
  ASSERT_TRUE(schedule.on_frame(frame(11, 330)));
  EXPECT_TRUE(schedule.pending());
  EXPECT_TRUE(schedule.take_release().frame_missing);
  EXPECT_TRUE(schedule.pending());
  EXPECT_EQ(schedule.take_release().frame_sequence, 11U);
  EXPECT_FALSE(schedule.pending());
}

// The camera is away for 5 s and counts on by one when it is back, as one that is opened again does.
TEST(ReleaseSchedule, AfterAnOutageEveryFrameIsReleasedThoughTheNumbersHaveNoGap) {
  ReleaseSchedule schedule = running(10);
  const auto take_until = [&](Instant t) {
    while (schedule.next()->deadline <= t) EXPECT_TRUE(schedule.take_release().frame_missing);
  };
  for (int i = 0; i < 60; ++i) {
    const int capture_ms = 5277 + 30 * i;
    if (i == 0) take_until(at_ms(capture_ms + 12));
    ASSERT_TRUE(schedule.on_frame(frame(static_cast<std::uint64_t>(10 + i), capture_ms))) << i;
    EXPECT_EQ(schedule.period(), milliseconds(30));
    Release release = schedule.take_release();
    // Up to the first one what is released may still be the last of the outage.
    while (i == 0 && release.frame_missing) release = schedule.take_release();
    EXPECT_FALSE(release.frame_missing) << i;
    EXPECT_EQ(release.deadline, at_ms(capture_ms + 50));
  }
}

TEST(ReleaseSchedule, AnOutageAfterTheVeryFirstFrameIsNotTakenForThePeriodForLong) {
  ReleaseSchedule schedule = running(1);
  for (int i = 0; i < 20; ++i) {
    const int capture_ms = 5000 + 30 * i;
    ASSERT_TRUE(schedule.on_frame(frame(static_cast<std::uint64_t>(1 + i), capture_ms))) << i;
    EXPECT_EQ(schedule.take_release().deadline, at_ms(capture_ms + 50));
  }
  EXPECT_EQ(schedule.period(), milliseconds(30));
}

TEST(ReleaseSchedule, FollowsAnotherFrameRateWithinSomeFramesAndRefusesNone) {
  for (const int period_ms : {15, 60}) {
    ReleaseSchedule schedule = running(10);
    int missing = 0;
    for (int i = 1; i <= 30; ++i) {
      const int capture_ms = 270 + period_ms * i;
      ASSERT_TRUE(schedule.on_frame(frame(static_cast<std::uint64_t>(9 + i), capture_ms))) << i;
      while (schedule.next()->deadline <= at_ms(capture_ms + 50))
        missing += schedule.take_release().frame_missing ? 1 : 0;
    }
    EXPECT_EQ(schedule.period(), milliseconds(period_ms));
    EXPECT_LE(missing, 8);
  }
}

TEST(ReleaseSchedule, FitsThePeriodThroughJitter) {
  ReleaseSchedule schedule(kLatency);
  for (int i = 0; i < 200; ++i) {
    const int capture_ms = 30 * i + (i % 3) * 2;
    ASSERT_TRUE(schedule.on_frame(frame(static_cast<std::uint64_t>(i), capture_ms)));
    EXPECT_FALSE(schedule.take_release().frame_missing);
  }
  EXPECT_NEAR(to_seconds(schedule.period()), 0.030, 0.001);
}

}  // namespace
}  // namespace perimap

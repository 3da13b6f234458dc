#include "core/pipeline/release_plan.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/unit/pipeline/stamped_frames.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using test::at_ms;
using test::frame;
using test::kLatency;

// Frames 30 ms apart, each told of when it arrives; everything that is due by `until_ms` is taken at its instant.
std::vector<Release> run(ReleasePlan& plan, int frames, int until_ms) {
  std::vector<Release> taken;
  const auto take_until = [&](Instant t) {
    for (auto next = plan.next(); next && next->deadline <= t; next = plan.next()) taken.push_back(plan.take_release());
  };
  for (int i = 0; i < frames; ++i) {
    take_until(at_ms(30 * i + 12));
    EXPECT_TRUE(plan.on_frame(frame(static_cast<std::uint64_t>(i), 30 * i), at_ms(30 * i + 12)));
  }
  take_until(at_ms(until_ms));
  return taken;
}

std::vector<Release> of(ReleaseStream stream, const std::vector<Release>& all) {
  std::vector<Release> some;
  for (const Release& release : all) {
    if (release.stream == stream) some.push_back(release);
  }
  return some;
}

TEST(ReleasePlan, WithoutAClockIsTheFramesSchedule) {
  ReleasePlan plan({kLatency, true, Duration(0)});
  EXPECT_FALSE(plan.next().has_value());
  const std::vector<Release> taken = run(plan, 10, 30 * 9 + 50);
  ASSERT_EQ(taken.size(), 10U);
  for (std::size_t i = 0; i < taken.size(); ++i) {
    EXPECT_EQ(taken[i].stream, ReleaseStream::kFrame);
    EXPECT_EQ(taken[i].deadline, at_ms(30 * static_cast<int>(i) + 50));
  }
}

TEST(ReleasePlan, TheClockReleasesAtTheMultiplesOfItsPeriodFromTheFirstFramesReleaseOn) {
  ReleasePlan plan({kLatency, false, milliseconds(7)});
  EXPECT_FALSE(plan.next().has_value()) << "before the first frame there is nothing to tell of";
  const std::vector<Release> taken = run(plan, 10, 400);
  ASSERT_GT(taken.size(), 40U);
  EXPECT_EQ(taken.front().deadline, Instant(milliseconds(10'052))) << "1436 * 7, the first at 10'050 or after";
  for (std::size_t i = 0; i < taken.size(); ++i) {
    EXPECT_EQ(taken[i].stream, ReleaseStream::kClock);
    EXPECT_EQ(taken[i].deadline.time_since_epoch() % milliseconds(7), Duration(0));
    if (i == 0) continue;
    EXPECT_EQ(taken[i].deadline - taken[i - 1].deadline, milliseconds(7));
  }
}

TEST(ReleasePlan, AReleaseOfTheClockTellsWhichFrameIsOwedByThen) {
  ReleasePlan plan({kLatency, false, milliseconds(10)});
  for (const Release& release : run(plan, 10, 30 * 9 + 50)) {
    const auto owed = static_cast<std::uint64_t>((release.deadline - at_ms(50)) / milliseconds(30));
    EXPECT_EQ(release.frame_sequence, owed);
    EXPECT_EQ(release.capture, at_ms(30 * static_cast<int>(owed)));
    EXPECT_FALSE(release.frame_missing);
  }
}

TEST(ReleasePlan, WhenFramesStopTheClockGoesOnAndSaysSo) {
  ReleasePlan plan({kLatency, false, milliseconds(10)});
  run(plan, 10, 30 * 9 + 50);
  for (int ms = 330; ms < 400; ms += 10) {
    const Release release = plan.take_release();
    EXPECT_EQ(release.deadline, at_ms(ms));
    EXPECT_EQ(release.frame_missing, ms >= 350) << ms << ": the next would have been due at 350";
  }
}

TEST(ReleasePlan, BothStreamsComeInOrderOfTimeAndNeitherChangesTheOther) {
  ReleasePlan both({kLatency, true, milliseconds(10)});
  ReleasePlan frames({kLatency, true, Duration(0)});
  ReleasePlan clock({kLatency, false, milliseconds(10)});
  const std::vector<Release> taken = run(both, 10, 500);
  for (std::size_t i = 1; i < taken.size(); ++i) {
    EXPECT_GE(taken[i].deadline, taken[i - 1].deadline);
    if (taken[i].deadline == taken[i - 1].deadline) {
      EXPECT_EQ(taken[i - 1].stream, ReleaseStream::kFrame) << "so that the clock knows of it";
    }
  }
  const auto same = [](const std::vector<Release>& a, const std::vector<Release>& b) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(a[i].deadline, b[i].deadline);
      EXPECT_EQ(a[i].frame_sequence, b[i].frame_sequence);
      EXPECT_EQ(a[i].frame_missing, b[i].frame_missing);
    }
  };
  same(of(ReleaseStream::kFrame, taken), run(frames, 10, 500));
  same(of(ReleaseStream::kClock, taken), run(clock, 10, 500));
}

TEST(ReleasePlan, AClockSlowerThanTheFramesLosesNoneOfThem) {
  ReleasePlan plan({kLatency, false, std::chrono::seconds(5)});
  for (int i = 0; i < 300; ++i) {
    EXPECT_TRUE(plan.on_frame(frame(static_cast<std::uint64_t>(i), 10 * i), at_ms(10 * i + 12))) << i;
  }
  EXPECT_EQ(plan.last_due().frame_sequence, 295U);
}

TEST(ReleasePlan, ReleasesThatAnotherHasCaughtUpWithAreLeftOutAndCounted) {
  ReleasePlan plan({kLatency, false, milliseconds(10)});
  const auto left_out = [&](int ms) { return plan.leave_out_missed(at_ms(ms))[index_of(ReleaseStream::kClock)]; };
  run(plan, 10, 320);
  EXPECT_EQ(plan.next()->deadline, at_ms(330));
  EXPECT_EQ(left_out(339), 0U) << "late, but its turn still";
  EXPECT_EQ(left_out(340), 1U);
  EXPECT_EQ(left_out(340), 0U) << "counted once";
  EXPECT_EQ(plan.next()->deadline, at_ms(340));
  EXPECT_EQ(left_out(395), 5U);
  EXPECT_EQ(plan.take_release().deadline, at_ms(390)) << "on the grid as before";
}

// Ten frames in time, then the publisher is held up: what arrives until `now_ms` is told of at that instant, at once.
ReleasePlan held_up(const ReleasePlanSettings& settings, int now_ms) {
  ReleasePlan plan(settings);
  run(plan, 10, 30 * 9 + 50);
  for (int i = 10; 30 * i + 12 <= now_ms; ++i) {
    EXPECT_TRUE(plan.on_frame(frame(static_cast<std::uint64_t>(i), 30 * i), at_ms(now_ms))) << i;
  }
  return plan;
}

TEST(ReleasePlan, FramesThatArrivedWhileThePublisherWasHeldUpAreReleasedAsTheFramesTheyAre) {
  ReleasePlan plan = held_up({kLatency, true, Duration(0), milliseconds(200)}, 470);
  EXPECT_EQ(plan.leave_out_missed(at_ms(470)), MissedReleases{});
  for (std::uint64_t i = 10; i <= 15; ++i) {
    const Release release = plan.take_release();
    EXPECT_FALSE(release.frame_missing) << i;
    EXPECT_EQ(release.frame_sequence, i);
  }
}

TEST(ReleasePlan, TheClockTellsOfTheFramesThatArrivedWhileThePublisherWasHeldUp) {
  for (const int now_ms : {470, 5000}) {
    ReleasePlan plan = held_up({kLatency, false, milliseconds(10), milliseconds(200)}, now_ms);
    EXPECT_GT(plan.leave_out_missed(at_ms(now_ms))[index_of(ReleaseStream::kClock)], 0U);
    const Release release = plan.take_release();
    EXPECT_FALSE(release.frame_missing);
    EXPECT_EQ(release.frame_sequence, static_cast<std::uint64_t>((release.deadline - at_ms(50)) / milliseconds(30)));
  }
}

TEST(ReleasePlan, FramesReleasesThatNobodyCanUseAnyMoreAreLeftOutAndCounted) {
  ReleasePlan plan = held_up({kLatency, true, Duration(0), milliseconds(200)}, 10'270);
  const auto left_out = plan.leave_out_missed(at_ms(10'270))[index_of(ReleaseStream::kFrame)];
  ASSERT_EQ(plan.next()->deadline, at_ms(10'070)) << "its surface may be used until now";
  EXPECT_EQ(left_out, (10'070 - 350) / 30U);
  EXPECT_EQ(plan.leave_out_missed(at_ms(10'270)), MissedReleases{}) << "counted once";
  int sent = 0;
  for (; plan.next()->deadline <= at_ms(10'270); ++sent) EXPECT_FALSE(plan.take_release().frame_missing);
  EXPECT_EQ(sent, 7);
}

TEST(ReleasePlan, WhenNoFrameHasComeEitherTheReleasesWithoutOneAreLeftOutAsWell) {
  ReleasePlan plan({kLatency, true, milliseconds(10), milliseconds(200)});
  run(plan, 10, 30 * 9 + 50);
  const MissedReleases missed = plan.leave_out_missed(at_ms(10'270));
  EXPECT_EQ(missed[index_of(ReleaseStream::kFrame)], 324U);
  EXPECT_GT(missed[index_of(ReleaseStream::kClock)], 900U);
  EXPECT_TRUE(plan.next()->frame_missing);
}

// However long a surface may be used: more at once than a reader keeps would be lost to it.
TEST(ReleasePlan, NoMoreReleasesThanAReaderKeepsFollowOneUponTheOther) {
  ReleasePlan plan = held_up({kLatency, true, Duration(0), std::chrono::seconds(5)}, 2000);
  EXPECT_GT(plan.leave_out_missed(at_ms(2000))[index_of(ReleaseStream::kFrame)], 40U);
  int sent = 0;
  while (plan.next()->deadline <= at_ms(2000)) {
    plan.take_release();
    ++sent;
  }
  EXPECT_EQ(sent, ReleasePlan::kMostTogether);
}

TEST(ReleasePlan, AfterARestartTheClockBeginsWithTheNextReleaseThatIsExpected) {
  ReleasePlan plan({kLatency, false, milliseconds(10)});
  plan.resume(at_ms(0), milliseconds(30), at_ms(105));
  const auto next = plan.next();
  ASSERT_TRUE(next);
  EXPECT_EQ(next->deadline, at_ms(110)) << "30 ms after the release at 80";
  EXPECT_TRUE(plan.take_release().frame_missing);
}

TEST(ReleasePlan, AfterARestartNoReleaseHasANumberUntilAFrameHasOne) {
  ReleasePlan plan({kLatency, true, milliseconds(10)});
  plan.resume(at_ms(0), milliseconds(30), at_ms(105));
  for (int i = 0; i < 8; ++i) EXPECT_EQ(plan.take_release().frame_sequence, 0U);
  while (plan.next()->deadline < at_ms(190)) static_cast<void>(plan.take_release());
  ASSERT_TRUE(plan.on_frame(frame(3, 180), at_ms(192)));
  std::vector<std::uint64_t> of_frames;
  while (of_frames.size() < 3) {
    const Release release = plan.take_release();
    if (release.stream == ReleaseStream::kFrame) of_frames.push_back(release.frame_sequence);
  }
  EXPECT_EQ(of_frames, (std::vector<std::uint64_t>{0, 3, 4})) << "that at 150, the frame, and one that is missing";
}

TEST(ReleasePlan, AYearIsPassedOverAtOnce) {
  for (const Duration clock_period : {Duration(0), Duration(milliseconds(10))}) {
    ReleasePlan plan({kLatency, true, clock_period});
    run(plan, 20, 30 * 20 + 60);
    const Instant later = at_ms(30 * 20 + 60) + std::chrono::days(365);
    const std::uint64_t passed = plan.pass_over(later);
    EXPECT_GT(passed, std::uint64_t{365} * 86400 * 30);
    const auto next = plan.next();
    ASSERT_TRUE(next);
    EXPECT_GT(next->deadline, later - milliseconds(1));
    EXPECT_LE(next->deadline, later + milliseconds(31));
    EXPECT_EQ(plan.pass_over(later), 0U) << "and not again";
  }
}

}  // namespace
}  // namespace perimap

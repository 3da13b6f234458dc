#include "daemon/evaluation/watch/watch_screen.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace perimap {
namespace {

using testing::HasSubstr;
using testing::Not;

StreamReport report() {
  StreamReport report;
  report.source = "theatre 2";
  report.stream = "frame";
  report.length = std::chrono::seconds(1);
  report.received = 30;
  report.hearing = client::Hearing::kUse;
  SurfaceDigest& last = report.last.emplace();
  last.state = perimap_SURFACE_GOOD;
  last.features = {3, 12, 84, 0};
  last.median_deviation_mm = 0.31;
  perimap_SourceStatus tracker{};
  tracker.kind = perimap_SOURCE_TRACKER;
  tracker.state = perimap_SOURCE_STALLED;
  tracker.rate_hz = 59.5;
  tracker.last_source_time_ns = 1'000'000'000;
  report.status.emplace();
  report.status->status.time_ns = 1'250'000'000;
  report.status->sources = {tracker};
  return report;
}

std::string screen(const StreamReport& report, bool colours = false) {
  return watch_screen(std::array{report}, {"perimap watch", colours});
}

TEST(WatchScreen, SaysFirstWhatMayBeTrusted) {
  const std::string text = screen(report());
  EXPECT_THAT(text, HasSubstr("theatre 2 / frame\n\n  GOOD  may be used\n"));
  EXPECT_THAT(text, Not(HasSubstr("because")));
  EXPECT_LT(text.find("GOOD"), text.find("84 converged"));
  EXPECT_THAT(text, HasSubstr("30.0/s, 0 lost"));
  EXPECT_THAT(text, testing::ContainsRegex("tracker +stalled +59.5 +250 "));
}

TEST(WatchScreen, SaysWhyNotAndWhatToDo) {
  StreamReport degraded = report();
  degraded.last->state = perimap_SURFACE_DEGRADED;
  degraded.last->reason = perimap_SURFACE_REASON_POSE_MISSING;
  EXPECT_THAT(screen(degraded), HasSubstr("DEGRADED  use with care\n  because     no pose of the scope"));
  EXPECT_THAT(screen(degraded), HasSubstr("\n  do          "));
}

TEST(WatchScreen, OfWhatMayNotBeUsedNothingIsShownAsGood) {
  StreamReport two = report();
  two.hearing = client::Hearing::kTwoPublishers;
  EXPECT_THAT(screen(two), HasSubstr("USE NONE  use no position"));
  EXPECT_THAT(screen(two), Not(HasSubstr("converged")));
  StreamReport listening = report();
  listening.hearing = client::Hearing::kListening;
  EXPECT_THAT(screen(listening), HasSubstr("LISTENING  use no position"));
  StreamReport silent = report();
  silent.received = 0;
  EXPECT_THAT(screen(silent), HasSubstr("NOTHING COMES  use no position"));
  EXPECT_THAT(screen(silent), Not(HasSubstr("converged")));
  EXPECT_THAT(screen(silent), Not(HasSubstr("stalled")));
  StreamReport late = report();
  late.expired = late.received;
  EXPECT_THAT(screen(late), HasSubstr("TOO LATE  use no position"));
  for (const StreamReport& bad : {two, listening, silent, late}) EXPECT_THAT(screen(bad), Not(HasSubstr("GOOD")));
}

TEST(WatchScreen, NamesOfAPublisherMoveNoCursor) {
  StreamReport hostile = report();
  hostile.source = "\x1b[2J\r\n\x07";
  const std::string text = screen(hostile);
  EXPECT_TRUE(std::all_of(text.begin(), text.end(), [](char c) { return c == '\n' || (c >= ' ' && c <= '~'); }));
}

TEST(WatchScreen, ColoursAreNotTheOnlySign) {
  EXPECT_THAT(screen(report()), Not(HasSubstr("\x1b")));
  EXPECT_THAT(screen(report(), true), HasSubstr("\x1b[1;30;42m GOOD \x1b[0m  may be used"));
}

}  // namespace
}  // namespace perimap

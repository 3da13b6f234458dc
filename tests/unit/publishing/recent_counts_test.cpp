#include "daemon/publishing/recent_counts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/publishing/status_text.hpp"
#include "daemon/publishing/wire_status.hpp"

namespace perimap {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

const Instant kStart = from_ns(0) + seconds(1000);

class RecentCountsTest : public ::testing::Test {
 protected:
  // A second in which every release was so late and the tracker gave 100 poses, noted at its end.
  void pass_second(Duration tardiness) {
    now_ += seconds(1);
    for (int i = 0; i < 60; ++i) counters_->of(ReleaseStream::kFrame).release_tardiness.add(tardiness);
    counters_->poses_received.add(100);
    counters_->last_pose_ns.set(static_cast<std::uint64_t>(to_ns(now_)));
    recent_.note(*counters_, now_);
  }
  perimap_StageLatency tardiness(const perimap_Status& status) {
    const perimap_StageLatency* begin = status.stages._buffer;
    return *std::find_if(begin, begin + status.stages._length,
                         [](const auto& stage) { return stage.kind == perimap_STAGE_RELEASE_TARDINESS; });
  }
  const perimap_Status& status() {
    StatusFacts facts;
    facts.recent = &recent_;
    return wire_.fill(*counters_, facts, now_);
  }

  std::unique_ptr<PipelineCounters> counters_ = std::make_unique<PipelineCounters>();
  RecentCounts recent_;
  WireStatus wire_{Identity{"a", ReleaseStream::kFrame, "tracker"}};
  Instant now_ = kStart;
};

TEST_F(RecentCountsTest, WhatIsLongAgoCountsSinceTheStartAlone) {
  recent_.note(*counters_, now_);
  pass_second(milliseconds(30));
  for (int i = 0; i < 20; ++i) pass_second(microseconds(10));
  const perimap_Status& told = status();
  EXPECT_EQ(told.recent_ns, 10'000'000'000);
  const perimap_StageLatency stage = tardiness(told);
  EXPECT_EQ(stage.count, 21U * 60U);
  EXPECT_EQ(stage.max_ns, 30'000'000);
  EXPECT_EQ(stage.recent_count, 10U * 60U);
  EXPECT_NEAR(static_cast<double>(stage.recent_max_ns), 10e3, 10e3 / 16);
  EXPECT_NEAR(static_cast<double>(stage.recent_p999_ns), 10e3, 10e3 / 16);
  EXPECT_DOUBLE_EQ(told.sources._buffer[1].rate_hz, 100.0);
}

TEST_F(RecentCountsTest, OneLateReleaseInTheLastSecondsIsSeenThere) {
  recent_.note(*counters_, now_);
  for (int i = 0; i < 20; ++i) pass_second(microseconds(10));
  counters_->of(ReleaseStream::kFrame).release_tardiness.add(milliseconds(5));
  const perimap_StageLatency stage = tardiness(status());
  EXPECT_NEAR(static_cast<double>(stage.recent_max_ns), 5e6, 5e6 / 16);
  EXPECT_NEAR(static_cast<double>(stage.recent_p50_ns), 10e3, 10e3 / 16);
}

TEST_F(RecentCountsTest, BeforeTenSecondsHavePassedTheyReachToTheStart) {
  recent_.note(*counters_, now_);
  for (int i = 0; i < 3; ++i) pass_second(microseconds(10));
  EXPECT_EQ(status().recent_ns, 3'000'000'000);
  EXPECT_EQ(tardiness(status()).recent_count, 180U);
}

TEST_F(RecentCountsTest, NotesMoreOftenThanOnceASecondDoNotShortenThem) {
  for (int i = 0; i < 300; ++i) recent_.note(*counters_, now_ + milliseconds(100) * i);
  now_ += milliseconds(100) * 300;
  EXPECT_GE(status().recent_ns, 10'000'000'000);
  EXPECT_LE(status().recent_ns, 11'000'000'000);
}

TEST_F(RecentCountsTest, WithoutThemTheStatusSaysSo) {
  pass_second(microseconds(10));
  const perimap_Status& told = wire_.fill(*counters_, StatusFacts{}, now_);
  EXPECT_EQ(told.recent_ns, 0);
  EXPECT_EQ(tardiness(told).recent_count, 0U);
  EXPECT_EQ(tardiness(told).count, 60U);
}

TEST_F(RecentCountsTest, TheStatusTellsWhenASourceWasLastGood) {
  pass_second(microseconds(10));
  EXPECT_TRUE(full_status_json(status())["sources"]["tracker"]["last_good_age_ms"].is_null());
  counters_->last_good_pose_ns.set(static_cast<std::uint64_t>(to_ns(now_ - milliseconds(250))));
  const auto json = full_status_json(status());
  EXPECT_DOUBLE_EQ(json["sources"]["tracker"]["last_good_age_ms"], 250.0);
  EXPECT_DOUBLE_EQ(json["sources"]["tracker"]["age_ms"], 0.0);
}

TEST_F(RecentCountsTest, EachStreamHasAStatusWithItsOwnReleases) {
  PipelineSettings settings;
  settings.clock_period = milliseconds(1);
  std::vector<WireStatus> statuses = wire_statuses({"a", ReleaseStream::kFrame, "tracker"}, settings);
  ASSERT_EQ(statuses.size(), 2U);
  recent_.note(*counters_, now_);
  counters_->frames.add(9);
  counters_->of(ReleaseStream::kFrame).samples.add(5);
  StreamCounters& clock = counters_->of(ReleaseStream::kClock);
  clock.samples.add(70);
  clock.releases_missed.add(3);
  clock.count_tardiness(microseconds(2));
  clock.count_tardiness(milliseconds(2));
  StatusFacts facts;
  facts.recent = &recent_;
  const perimap_Status& of_frames = statuses[0].fill(*counters_, facts, now_ + seconds(1));
  const perimap_Status& of_clock = statuses[1].fill(*counters_, facts, now_ + seconds(1));
  EXPECT_STREQ(of_frames.stream, "frame");
  EXPECT_STREQ(of_clock.stream, "clock");
  EXPECT_EQ(of_frames.frames, 9U);
  EXPECT_EQ(of_clock.frames, 9U);
  EXPECT_EQ(of_frames.samples, 5U);
  EXPECT_EQ(of_clock.samples, 70U);
  EXPECT_EQ(of_frames.releases_missed, 0U);
  EXPECT_EQ(of_clock.releases_missed, 3U);
  EXPECT_EQ(of_frames.releases_late, 0U);
  EXPECT_EQ(of_clock.releases_late, 1U);
  EXPECT_EQ(tardiness(of_frames).count, 0U);
  EXPECT_EQ(tardiness(of_clock).recent_count, 2U);
  // As `perimap ctl status` and a replay's report have them.
  EXPECT_EQ(stream_status_json(of_frames)["releases_late"], 0);
  for (const auto& json : {full_status_json(of_clock), stream_status_json(of_clock), counts_json(of_clock)}) {
    EXPECT_EQ(json["releases_missed"], 3);
    EXPECT_EQ(json["releases_late"], 1);
  }
}

TEST(WireStatusTest, TellsWhyFeaturesAreNotInTheMap) {
  PipelineCounters counters;
  counters.features_lost_unseen.add(1);
  counters.features_lost_refused.add(2);
  counters.features_lost_unstarted.add(4);
  for (std::size_t i = 0; i < kBatchStatuses; ++i) counters.starts_failed[i].add(1U << i);
  counters.features_tracked.set(30);
  counters.start_matches_needed.set(60);
  counters.start_matches_most.set(45);
  counters.start_matches_mean.set(20);
  WireStatus wire(Identity{"a", ReleaseStream::kFrame, "tracker"});
  const perimap_Status& told = wire.fill(counters, {}, kStart);
  const auto json = full_status_json(told);
  EXPECT_EQ(json["features_lost"], 7);
  EXPECT_EQ(json["features_lost_unseen"], 1);
  EXPECT_EQ(json["features_lost_refused"], 2);
  EXPECT_EQ(json["features_lost_unstarted"], 4);
  EXPECT_EQ(json["starts_failed_unusable"], 2 + 4);
  EXPECT_EQ(json["starts_failed_behind"], 8);
  EXPECT_EQ(json["starts_failed_diverged"], 16);
  EXPECT_EQ(json["starts_failed_outliers"], 32);
  EXPECT_EQ(json["start_matches_needed"], 60);
  EXPECT_EQ(json["start_matches_most"], 45);
  EXPECT_EQ(json["start_matches_mean"], 20);
  const auto counts = counts_json(told);
  for (const auto& [name, count] : counts.items()) EXPECT_EQ(json[name], count) << name;
  EXPECT_TRUE(counts.contains("starts_failed_outliers"));
  EXPECT_NE(status_line(told).find("30 followed with 20 of the 60 matches"), std::string::npos);
  counters.features_converged.set(1);
  EXPECT_EQ(status_line(wire.fill(counters, {}, kStart)).find("followed"), std::string::npos);
}

TEST(WireStatuses, OnlyStreamsThatArePublishedHaveOne) {
  PipelineSettings settings;
  EXPECT_EQ(wire_statuses({}, settings).size(), 1U);
  settings.frame_stream = false;
  settings.clock_period = milliseconds(10);
  std::vector<WireStatus> statuses = wire_statuses({}, settings);
  ASSERT_EQ(statuses.size(), 1U);
  PipelineCounters counters;
  EXPECT_STREQ(statuses[0].fill(counters, {}, kStart).stream, "clock");
}

}  // namespace
}  // namespace perimap

#include "daemon/evaluation/watch/watch_statistics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "daemon/dds/bounded_string.hpp"
#include "daemon/evaluation/watch/watch_report.hpp"

namespace perimap {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

// Surfaces released every 10 ms, 50 ms after their capture.
perimap_Surface surface(std::uint64_t sequence, const char* source = "a") {
  perimap_Surface surface{};
  dds::assign(surface.source, source);
  dds::assign(surface.stream, "frame");
  surface.sample_sequence = sequence;
  surface.release_time_ns = to_ns(from_ns(0) + seconds(100) + milliseconds(10) * sequence);
  surface.capture_time_ns = surface.release_time_ns - 50'000'000;
  surface.valid_until_ns = surface.release_time_ns + 30'000'000;
  surface.state = perimap_SURFACE_GOOD;
  return surface;
}

Instant release_of(const perimap_Surface& surface) { return from_ns(surface.release_time_ns); }

TEST(WatchStatistics, CountsTheSequenceNumbersThatNeverCame) {
  WatchStatistics statistics;
  for (const std::uint64_t sequence : {7U, 8U, 9U, 12U, 13U, 20U}) {
    statistics.add(surface(sequence), release_of(surface(sequence)));
  }
  const std::vector<StreamReport> reports = statistics.totals();
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_EQ(reports[0].received, 6U);
  EXPECT_EQ(reports[0].missing, 2U + 6U);
  EXPECT_EQ(reports[0].restarts, 0U);
}

TEST(WatchStatistics, ASequenceThatBeginsAnewIsARestartAndNoLoss) {
  WatchStatistics statistics;
  for (const std::uint64_t sequence : {100U, 101U, 0U, 1U}) {
    statistics.add(surface(sequence), from_ns(0) + seconds(200));
  }
  EXPECT_EQ(statistics.totals().at(0).missing, 0U);
  EXPECT_EQ(statistics.totals().at(0).restarts, 1U);
}

TEST(WatchStatistics, StreamsAreCountedApart) {
  WatchStatistics statistics;
  for (std::uint64_t sequence = 0; sequence < 5; ++sequence) {
    statistics.add(surface(sequence, "a"), release_of(surface(sequence)));
    statistics.add(surface(2 * sequence, "b"), release_of(surface(sequence)));
  }
  const std::vector<StreamReport> reports = statistics.totals();
  ASSERT_EQ(reports.size(), 2U);
  EXPECT_EQ(reports[0].missing, 0U);
  EXPECT_EQ(reports[1].missing, 4U);
  EXPECT_EQ(statistics.surfaces(), 10U);
}

TEST(WatchStatistics, MeasuresLatencyLatenessAndJitterAgainstTheSamplesOwnTimes) {
  WatchStatistics statistics;
  // Delays after the release: 1, 1, 4, 1 ms; so the receipt intervals differ from the release intervals by 0, 3, 3 ms.
  const int delays_ms[] = {1, 1, 4, 1};
  for (std::uint64_t sequence = 0; sequence < 4; ++sequence) {
    statistics.add(surface(sequence), release_of(surface(sequence)) + milliseconds(delays_ms[sequence]));
  }
  const StreamReport report = statistics.take_interval(seconds(1)).at(0);
  EXPECT_EQ(report.latency.count, 4U);
  EXPECT_EQ(report.latency.p50, milliseconds(51));
  EXPECT_EQ(report.latency.max, milliseconds(54));
  EXPECT_EQ(report.lateness.p50, milliseconds(1));
  EXPECT_EQ(report.lateness.max, milliseconds(4));
  EXPECT_EQ(report.jitter.count, 3U);
  EXPECT_EQ(report.jitter.p50, milliseconds(3));
  EXPECT_EQ(report.jitter.max, milliseconds(3));
}

TEST(WatchStatistics, ALostSampleIsNoJitter) {
  WatchStatistics statistics;
  for (const std::uint64_t sequence : {0U, 1U, 5U}) {
    statistics.add(surface(sequence), release_of(surface(sequence)) + milliseconds(2));
  }
  EXPECT_EQ(statistics.totals().at(0).jitter.max, Duration(0));
}

TEST(WatchStatistics, AnIntervalBeginsWhereTheLastOneEnded) {
  WatchStatistics statistics;
  statistics.add(surface(0), release_of(surface(0)));
  EXPECT_EQ(statistics.take_interval(seconds(1)).at(0).received, 1U);
  statistics.add(surface(3), release_of(surface(3)));
  const StreamReport second = statistics.take_interval(seconds(1)).at(0);
  EXPECT_EQ(second.received, 1U);
  EXPECT_EQ(second.missing, 2U);
  EXPECT_EQ(statistics.take_interval(seconds(1)).at(0).received, 0U);
  EXPECT_EQ(statistics.totals().at(0).received, 2U);
}

TEST(WatchStatistics, CountsSamplesThatCameAfterTheirValidity) {
  WatchStatistics statistics;
  statistics.add(surface(0), release_of(surface(0)) + milliseconds(30));
  statistics.add(surface(1), release_of(surface(1)) + milliseconds(31));
  EXPECT_EQ(statistics.totals().at(0).expired, 1U);
}

TEST(WatchStatistics, MedianDeviationIsTheLargestInAnyDirectionOfTheFeaturesThatAreNotInvalid) {
  std::vector<perimap_SurfaceFeature> features(4);
  const double variances[] = {1.0, 4.0, 9.0, 1e6};
  for (std::size_t i = 0; i < features.size(); ++i) {
    // Largest along (1, 1, 0) / sqrt(2), so that no diagonal element shows it.
    const double half = variances[i] / 2;
    const double covariance[6] = {half, half, 0, half, 0, 0.01};
    std::copy_n(covariance, 6, features[i].covariance_W_mm2);
    features[i].state = i < 2 ? perimap_FEATURE_CONVERGED : perimap_FEATURE_CONVERGING;
  }
  features[3].state = perimap_FEATURE_INVALID;
  perimap_Surface sample = surface(0);
  sample.features._buffer = features.data();
  sample.features._length = 4;
  WatchStatistics statistics;
  statistics.add(sample, release_of(sample));
  const SurfaceDigest digest = *statistics.totals().at(0).last;
  ASSERT_TRUE(digest.median_deviation_mm);
  EXPECT_NEAR(*digest.median_deviation_mm, 2.0, 1e-9);
  EXPECT_THAT(digest.features, ::testing::ElementsAre(1, 1, 2, 0));
}

TEST(DurationCounts, GivesNearestRankPercentiles) {
  DurationCounts counts;
  EXPECT_EQ(counts.spread().count, 0U);
  for (int i = 200; i > 0; --i) {
    counts.add(microseconds(i));
  }
  EXPECT_EQ(counts.spread().count, 200U);
  EXPECT_EQ(counts.spread().p50, microseconds(100));
  EXPECT_EQ(counts.spread().p99, microseconds(198));
  EXPECT_EQ(counts.spread().max, microseconds(200));
}

TEST(WatchReport, JsonIsOneLineAndParsesWhateverTheNamesHold) {
  perimap_Surface sample = surface(0, "a\"\n\xff");
  sample.cardiac_phase_rad = std::nan("");
  WatchStatistics statistics;
  statistics.add(sample, release_of(sample));
  const std::string lines[] = {report_json(statistics.totals().at(0), ReportKind::kSummary),
                               surface_json(sample, release_of(sample))};
  for (const std::string& line : lines) {
    EXPECT_EQ(line.find('\n'), std::string::npos);
    const nlohmann::json json = nlohmann::json::parse(line);
    EXPECT_EQ(json["state"], "good");
    EXPECT_TRUE(json["cardiac_phase_rad"].is_null());
  }
}

TEST(WatchReport, JsonHasWhatTheStatusCountsOfReleases) {
  const perimap_Surface sample = surface(0);
  perimap_Status status{};
  dds::assign(status.source, sample.source);
  dds::assign(status.stream, sample.stream);
  status.releases_missed = 3;
  status.releases_late = 7;
  WatchStatistics statistics;
  statistics.add(sample, release_of(sample));
  statistics.add(status);
  const auto json = nlohmann::json::parse(report_json(statistics.totals().at(0), ReportKind::kSummary));
  EXPECT_EQ(json["status"]["releases_missed"], 3);
  EXPECT_EQ(json["status"]["releases_late"], 7);
}

TEST(WatchReport, TheLineTellsRateLossesStateAndReason) {
  WatchStatistics statistics;
  for (const std::uint64_t sequence : {0U, 1U, 3U}) {
    perimap_Surface sample = surface(sequence);
    sample.state = perimap_SURFACE_DEGRADED;
    sample.reason = perimap_SURFACE_REASON_PHASE_FREE_RUNNING;
    statistics.add(sample, release_of(sample) + microseconds(250));
  }
  const std::string line = report_line(statistics.take_interval(milliseconds(500)).at(0));
  EXPECT_THAT(line, HasSubstr("a/frame  6.0/s, 1 lost"));
  EXPECT_THAT(line, HasSubstr("latency 50.25 (p99 50.25, max 50.25) ms"));
  EXPECT_THAT(line, HasSubstr("degraded (phase_free_running)"));
}

// One source, heard twice: from the fifth second on another writes under its name, 60 a second both.
class TwoPublishers : public ::testing::Test {
 protected:
  void hear(std::uint8_t run, std::uint64_t writer, std::uint64_t sequence, Instant receipt) {
    perimap_Surface sample = surface(sequence, "perimapd");
    sample.run_id[0] = run;
    sample.release_time_ns = to_ns(receipt - milliseconds(1));
    sample.capture_time_ns = sample.release_time_ns - 50'000'000;
    sample.valid_until_ns = sample.release_time_ns + 200'000'000;
    statistics_.add(sample, receipt, writer);
  }
  [[nodiscard]] StreamReport totals() const { return statistics_.totals().at(0); }

  WatchStatistics statistics_;
  const Instant begin_{seconds(1000)};
};

TEST_F(TwoPublishers, AreToldAsSuchAndNotAsLossesAndRestarts) {
  for (int i = 0; i < 300; ++i) hear(1, 11, static_cast<std::uint64_t>(i), begin_ + milliseconds(16 * i));
  EXPECT_EQ(totals().hearing, client::Hearing::kUse);
  EXPECT_EQ(totals().contested, 0U);
  for (int i = 300; i < 600; ++i) {
    hear(2, 22, static_cast<std::uint64_t>(14'000'000 + i), begin_ + milliseconds(16 * i + 4));
    hear(1, 11, static_cast<std::uint64_t>(i), begin_ + milliseconds(16 * i + 8));
  }
  const StreamReport report = totals();
  EXPECT_EQ(report.hearing, client::Hearing::kTwoPublishers);
  EXPECT_EQ(report.received, 900U);
  EXPECT_EQ(report.contested, 599U) << "all but the first of the second one, which may have been a restart";
  EXPECT_LE(report.missing, 0U);
  EXPECT_LE(report.restarts, 1U);
  EXPECT_THAT(report_line(report), HasSubstr("TWO PUBLISHERS of this source: use neither"));
  EXPECT_THAT(report_line(report), ::testing::Not(HasSubstr("phase")));
  EXPECT_THAT(summary_text(report), HasSubstr("NOT TO BE USED: 599 surfaces"));
  EXPECT_THAT(report_json(report, ReportKind::kSummary), HasSubstr("\"contested\":599,\"publishers\":\"two\""));
}

TEST_F(TwoPublishers, OneSequenceNumberThatJumpsIsNoLossOfMillions) {
  for (int i = 0; i < 300; ++i) hear(1, 11, static_cast<std::uint64_t>(i), begin_ + milliseconds(16 * i));
  hear(1, 11, 14'000'000, begin_ + milliseconds(16 * 300));
  EXPECT_EQ(totals().missing, 0U);
  EXPECT_EQ(totals().contested, 1U);
  EXPECT_EQ(totals().hearing, client::Hearing::kImplausible);
}

TEST_F(TwoPublishers, WhatAStatusSaysOfThemCounts) {
  for (int i = 0; i < 300; ++i) hear(1, 11, static_cast<std::uint64_t>(i), begin_ + milliseconds(16 * i));
  perimap_Status status{};
  dds::assign(status.source, "perimapd");
  dds::assign(status.stream, "frame");
  status.run_id[0] = 1;
  status.two_publishers = true;
  statistics_.hear(status, begin_ + milliseconds(16 * 300), 12);
  hear(1, 11, 301, begin_ + milliseconds(16 * 301));
  EXPECT_EQ(totals().hearing, client::Hearing::kTwoPublishers);
}

TEST_F(TwoPublishers, ARestartIsARestart) {
  for (int i = 0; i < 300; ++i) hear(1, 11, static_cast<std::uint64_t>(i), begin_ + milliseconds(16 * i));
  for (int i = 400; i < 700; ++i) hear(2, 22, static_cast<std::uint64_t>(i - 400), begin_ + milliseconds(16 * i));
  EXPECT_EQ(totals().restarts, 1U);
  EXPECT_EQ(totals().missing, 0U);
  EXPECT_EQ(totals().contested, 0U);
  EXPECT_EQ(totals().hearing, client::Hearing::kUse);
}

perimap_ToolDistance tool(std::uint64_t sequence, const char* name = "instrument/probe") {
  perimap_ToolDistance tool{};
  dds::assign(tool.source, "a");
  dds::assign(tool.tool, name);
  tool.sample_sequence = sequence;
  tool.state = tool.states[0] = perimap_TOOL_GOOD;
  tool.distances_mm[0] = 3.21;
  tool.deviations_mm[0] = 0.4;
  tool.rates_mm_per_s[0] = -12.0;
  return tool;
}

TEST(WatchStatistics, TellsOfEachToolWhatWasHeardLastAndWhatNeverCame) {
  WatchStatistics statistics;
  statistics.add(surface(1), release_of(surface(1)));
  for (const std::uint64_t sequence : {1U, 2U, 5U}) statistics.add(tool(sequence));
  statistics.add(tool(1, "pointer"));
  const auto reports = statistics.take_interval(seconds(1));
  ASSERT_EQ(reports.size(), 1U);
  ASSERT_EQ(reports[0].tools.size(), 2U);
  EXPECT_EQ(reports[0].tools[0].received, 3U);
  EXPECT_EQ(reports[0].tools[0].missing, 2U);
  EXPECT_THAT(report_line(reports[0]), HasSubstr("instrument/probe 3.2 +- 0.4 mm, -12 mm/s"));
  const auto json = nlohmann::json::parse(report_json(reports[0], ReportKind::kInterval));
  EXPECT_EQ(json["tools"][0]["tool"], "instrument/probe");
  EXPECT_EQ(json["tools"][0]["distances_mm"][0], 3.21);
  // What has not been heard since is not told again.
  statistics.add(tool(6));
  const auto next = statistics.take_interval(seconds(1));
  ASSERT_EQ(next[0].tools.size(), 1U);
  EXPECT_EQ(next[0].tools[0].missing, 0U);
  EXPECT_EQ(statistics.totals()[0].tools[0].received, 4U);
}

TEST(WatchStatistics, AToolThatIsNotKnownIsSaidSoAndHasNoNumbers) {
  WatchStatistics statistics;
  statistics.add(surface(1), release_of(surface(1)));
  perimap_ToolDistance lost = tool(1);
  lost.state = lost.states[0] = perimap_TOOL_INVALID;
  lost.reason = lost.reasons[0] = perimap_TOOL_REASON_NOT_SEEN;
  lost.distances_mm[0] = std::nan("");
  statistics.add(lost);
  const StreamReport report = statistics.totals()[0];
  EXPECT_THAT(report_line(report), HasSubstr("instrument/probe: the tracker does not see it"));
  const auto json = nlohmann::json::parse(report_json(report, ReportKind::kSummary));
  EXPECT_TRUE(json["tools"][0]["distances_mm"][0].is_null());
  EXPECT_EQ(json["tools"][0]["reason"], "not_seen");
}

}  // namespace
}  // namespace perimap

#include "daemon/evaluation/bench/figures.hpp"

#include <gtest/gtest.h>

#include <variant>
#include <vector>

#include "daemon/evaluation/bench/bare_loop.hpp"
#include "daemon/evaluation/bench/bench.hpp"
#include "daemon/evaluation/bench/ddsperf_run.hpp"
#include "daemon/evaluation/bench/lockstep_run.hpp"
#include "daemon/evaluation/bench/subscriber.hpp"

namespace perimap::bench {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

TEST(Figures, AreNearestRankPercentilesOfAllValues) {
  std::vector<Duration> durations;
  for (int i = 1000; i >= 1; --i) durations.push_back(microseconds(i));
  const Figures f = figures_of(durations);
  EXPECT_EQ(f.count, 1000U);
  EXPECT_EQ(f.p50, microseconds(500));
  EXPECT_EQ(f.p99, microseconds(990));
  EXPECT_EQ(f.p999, microseconds(999));
  EXPECT_EQ(f.max, microseconds(1000));
  EXPECT_DOUBLE_EQ(f.on_time, 0.5);
}

TEST(Figures, OfFewValuesTheHighPercentilesAreTheLargest) {
  const Figures f = figures_of({microseconds(700), microseconds(3)});
  EXPECT_EQ(f.p50, microseconds(3));
  EXPECT_EQ(f.p99, microseconds(700));
  EXPECT_EQ(f.p999, microseconds(700));
  EXPECT_DOUBLE_EQ(f.on_time, 0.5);
}

TEST(Figures, OfNothingAreZero) { EXPECT_EQ(figures_of({}).count, 0U); }

TEST(MissingNumbers, AreThoseSentAndNeverReceived) {
  const std::uint64_t sent[] = {10, 11, 12, 13};
  const std::uint64_t received[] = {9, 11, 13, 10, 14};
  EXPECT_EQ(missing_numbers(sent, received), 1U);
  EXPECT_EQ(missing_numbers(sent, {}), 4U);
  EXPECT_EQ(missing_numbers({}, received), 0U);
}

TEST(Receipts, AreReadFromTheSubscribersLinesAndNothingElse) {
  const auto receipt = parse_receipt("17 123456789");
  ASSERT_TRUE(receipt);
  EXPECT_EQ(receipt->sequence, 17U);
  EXPECT_EQ(receipt->time, from_ns(123456789));
  for (const char* line : {"", "17", "17 ", " 17 1", "17 1 ", "17 x", "-1 1", "17  1", "99999999999999999999 1"}) {
    EXPECT_FALSE(parse_receipt(line)) << '"' << line << '"';
  }
}

// Releases every 10 ms, the newest at 100 ms.
Instant beside(Duration offset, Duration earliest) {
  return beside_a_release(from_ns(0) + milliseconds(100), milliseconds(10), offset, from_ns(0) + earliest);
}

TEST(BareLoopDeadlines, LieBesideTheNextReleaseAndLaterThanTheEarliest) {
  EXPECT_EQ(beside(milliseconds(2), milliseconds(101)), from_ns(0) + milliseconds(102));
  EXPECT_EQ(beside(milliseconds(-2), milliseconds(101)), from_ns(0) + milliseconds(108));
  EXPECT_EQ(beside(milliseconds(2), milliseconds(102)), from_ns(0) + milliseconds(112));
  EXPECT_EQ(beside(milliseconds(-2), milliseconds(543)), from_ns(0) + milliseconds(548));
}

TEST(LiveCases, RunWithAndWithoutPriorityInTurn) {
  BenchSettings settings;
  settings.parts = {"live"};
  settings.runs = 3;
  const auto cases = live_cases(settings, true);
  ASSERT_EQ(cases.size(), 6U);
  for (std::size_t i = 0; i < cases.size(); ++i) EXPECT_EQ(cases[i].priority > 0, i % 2 == 1) << i;
}

TEST(LiveCases, WithoutThePrivilegeNoneAsksForPriorityAndOnlyTheLoadAndTheLiveRunsAreFewer) {
  BenchSettings settings;
  settings.parts.insert(kParts.begin(), kParts.end());
  const auto permitted = live_cases(settings, true);
  const auto refused = live_cases(settings, false);
  for (const LiveCase& one : refused) EXPECT_EQ(one.priority, 0) << one.name;
  EXPECT_EQ(permitted.size() - refused.size(), static_cast<std::size_t>(settings.runs) + 1);
}

TEST(Ddsperf, ItsLinesOfASecondAreRead) {
  const auto second = parse_ddsperf_line(
      "[27320] 2.000  vm:27318 size 30000 mean 73.489us min 37.781us 50% 75.342us 90% 95.557us 99% 112.166us max "
      "113.5us cnt 60");
  ASSERT_TRUE(second);
  EXPECT_DOUBLE_EQ(second->p50_us, 75.342);
  EXPECT_DOUBLE_EQ(second->p99_us, 112.166);
  EXPECT_DOUBLE_EQ(second->max_us, 113.5);
  EXPECT_EQ(second->count, 60);
}

TEST(Ddsperf, ItsOtherLinesAreNotTakenForFigures) {
  for (const char* line :
       {"", "[27320] participant vm:27318: new", "[27320] 2.000  rss:7.6MB vcsw:135 ivcsw:7",
        "size 30000 mean 73.489us min 37.781us 50% 75.342us", "50% 75.3ms 99% 112.1us max 113.5us cnt 60",
        "x 50% 75.3ms 99% 112.1us max 113.5us cnt 60", "x 50% us 99% 112.1us max 113.5us cnt 60"}) {
    EXPECT_FALSE(parse_ddsperf_line(line)) << line;
  }
}

FrameEvent frame(std::uint64_t sequence, Duration capture) {
  FrameEvent event;
  event.stamp.sequence = sequence;
  event.stamp.capture = from_ns(0) + capture;
  event.stamp.arrival = event.stamp.capture + milliseconds(10);
  return event;
}

EcgBlock block(std::uint32_t sequence, Duration first) {
  EcgBlock ecg;
  ecg.device_sequence = sequence;
  ecg.count = 10;
  ecg.sample_period = milliseconds(4);
  ecg.first_sample_time = from_ns(0) + first;
  ecg.arrival = ecg.first_sample_time + milliseconds(45);
  return ecg;
}

// A recording of 2 s: frames 5 to 24 every 100 ms, ECG samples from 700 on.
std::vector<ReplayEvent> recording() {
  std::vector<ReplayEvent> events;
  for (int i = 0; i < 20; ++i) {
    events.emplace_back(frame(5U + static_cast<unsigned>(i), milliseconds(1000 + 100 * i)));
    events.emplace_back(block(700U + 25U * static_cast<unsigned>(i), milliseconds(1000 + 100 * i)));
  }
  return events;
}

TEST(Rounds, GoOnAfterASecondOfSilenceThatTheCountsShow) {
  Rounds rounds;
  std::vector<FrameStamp> frames;
  std::vector<EcgBlock> blocks;
  for (int round = 0; round < 3; ++round) {
    for (ReplayEvent& event : recording()) {
      rounds.move(event);
      if (const auto* f = std::get_if<FrameEvent>(&event)) frames.push_back(f->stamp);
      if (const auto* e = std::get_if<EcgBlock>(&event)) blocks.push_back(*e);
    }
    rounds.next_round();
  }
  ASSERT_EQ(frames.size(), 60U);
  EXPECT_EQ(frames.front().sequence, 5U);
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const bool seam = i % 20 == 0;
    // The last arrival is that of the last block, 35 ms after the last frame's.
    EXPECT_EQ(frames[i].capture - frames[i - 1].capture, seam ? milliseconds(1035) : milliseconds(100)) << i;
    EXPECT_EQ(frames[i].arrival - frames[i].capture, milliseconds(10)) << i;
    EXPECT_EQ(frames[i].sequence - frames[i - 1].sequence, seam ? 10U : 1U) << i;
  }
  for (std::size_t i = 1; i < blocks.size(); ++i) {
    const auto samples = static_cast<std::int64_t>(blocks[i].device_sequence - blocks[i - 1].device_sequence);
    const Duration passed = blocks[i].first_sample_time - blocks[i - 1].first_sample_time;
    EXPECT_NEAR(to_seconds(samples * milliseconds(4)), to_seconds(passed), 0.0041) << i;
  }
}

TEST(Paced, PlaysEveryNthFrameFasterAndEndsAfterItsLength) {
  const ReplayEdit edit = paced(2, 2.0, milliseconds(500));
  std::vector<FrameStamp> frames;
  bool ended = false;
  for (ReplayEvent& event : recording()) {
    const ReplayStep step = edit(event);
    ended = ended || step == ReplayStep::kEnd;
    if (ended) break;
    const auto* f = std::get_if<FrameEvent>(&event);
    if (f != nullptr && step == ReplayStep::kDeliver) frames.push_back(f->stamp);
    if (const auto* e = std::get_if<EcgBlock>(&event)) {
      EXPECT_EQ(e->sample_period, milliseconds(2));
    }
  }
  EXPECT_TRUE(ended);
  // 6, 8, 10, ... were 200 ms apart; the first arrival is at 1010 ms.
  ASSERT_EQ(frames.size(), 5U);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].sequence, 3U + i);
    EXPECT_EQ(frames[i].arrival, from_ns(0) + milliseconds(1010 + 50 + 100 * static_cast<int>(i)));
  }
}

// One of each kind that a recording may hold, each measured at 2000 ms and there 10 ms later.
TEST(Paced, MovesEveryInstantOfEveryKindOfEvent) {
  const Instant measured = from_ns(0) + milliseconds(2000);
  const Instant arrival = measured + milliseconds(10);
  TrackerSample pose;
  pose.source_time = measured;
  pose.arrival = arrival;
  EcgBlock ecg = block(0, milliseconds(2000));
  ecg.arrival = arrival;
  RespirationBlock respiration;
  respiration.first_sample_time = measured;
  respiration.arrival = arrival;
  respiration.sample_period = milliseconds(40);
  std::vector<ReplayEvent> events = {frame(0, milliseconds(2000)),
                                     pose,
                                     ToolPose{ToolRole::kSecondSensor, pose},
                                     ecg,
                                     RTriggerPulse{measured, arrival},
                                     respiration,
                                     ToolSample{pose, 1}};
  ASSERT_EQ(events.size(), std::variant_size_v<ReplayEvent>);

  const ReplayEdit edit = paced(1, 2.0, std::chrono::seconds(10));
  ReplayEvent first = frame(0, milliseconds(990));
  ASSERT_EQ(edit(first), ReplayStep::kDeliver);
  EXPECT_EQ(arrival_of(first), from_ns(0) + milliseconds(1000));
  const Instant measured_then = from_ns(0) + milliseconds(1500);
  const Instant arrival_then = measured_then + milliseconds(5);
  for (std::size_t i = 0; i < events.size(); ++i) {
    ASSERT_EQ(events[i].index(), i) << "not one of each";
    ASSERT_EQ(edit(events[i]), ReplayStep::kDeliver);
    EXPECT_EQ(arrival_of(events[i]), arrival_then) << i;
  }
  EXPECT_EQ(std::get<FrameEvent>(events[0]).stamp.capture, measured_then);
  EXPECT_EQ(std::get<TrackerSample>(events[1]).source_time, measured_then);
  EXPECT_EQ(std::get<ToolPose>(events[2]).sample.source_time, measured_then);
  EXPECT_EQ(std::get<EcgBlock>(events[3]).first_sample_time, measured_then);
  EXPECT_EQ(std::get<EcgBlock>(events[3]).sample_period, milliseconds(2));
  EXPECT_EQ(std::get<RTriggerPulse>(events[4]).time, measured_then);
  EXPECT_EQ(std::get<RespirationBlock>(events[5]).first_sample_time, measured_then);
  EXPECT_EQ(std::get<RespirationBlock>(events[5]).sample_period, milliseconds(20));
  EXPECT_EQ(std::get<ToolSample>(events[6]).source_time, measured_then);
}

}  // namespace
}  // namespace perimap::bench

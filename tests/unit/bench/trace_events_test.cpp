// Lives of frames, made by hand, as trace events.
#include "daemon/evaluation/bench/trace_events.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace perimap::bench {
namespace {

using nlohmann::json;
using std::chrono::microseconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr Instant kCapture(std::chrono::hours(24 * 300));  // of a machine that has run for long
constexpr Instant kZero = kCapture - std::chrono::seconds(2);

Instant at_us(int us) { return kCapture + microseconds(us); }

// Frame 7 as it goes, frame 8 that the mapper did not get, and a release without a frame.
FrameTrace made_trace() {
  FrameTrace trace(20, 2);
  trace.arrivals.add({{7, at_us(0), at_us(12'000)}, at_us(12'010), at_us(12'050)});
  trace.arrivals.add({{8, at_us(33'000), at_us(45'000)}, at_us(45'010), at_us(45'050)});
  trace.mapper.add({7, FramePart::kAwaitPose, at_us(12'060), at_us(13'000)});
  trace.mapper.add({7, FramePart::kPredictAndFind, at_us(13'001), at_us(15'000) + Duration(789)});
  trace.mapper.add({7, FramePart::kPhaseAndPose, at_us(15'000) + Duration(789), at_us(15'100)});
  trace.mapper.add({7, FramePart::kEvaluate, at_us(15'100), at_us(15'500)});
  trace.mapper.add({7, FramePart::kSettleMatches, at_us(15'500), at_us(15'900)});
  trace.mapper.add({7, FramePart::kHandOn, at_us(15'900), at_us(16'000)});
  trace.mapper.add({7, FramePart::kLearn, at_us(16'000), at_us(19'000)});
  trace.workers[0].add({7, FramePart::kPredictAndFind, at_us(13'100), at_us(14'900)});
  trace.workers[1].add({7, FramePart::kPredictAndFind, at_us(13'110), at_us(14'990)});
  trace.workers[1].add({7, FramePart::kLearn, at_us(16'010), at_us(19'000)});
  const Duration latency = microseconds(50'000);
  trace.releases.add({{7, at_us(0), at_us(0) + latency, false, ReleaseStream::kFrame},
                      false,
                      at_us(49'500),
                      at_us(49'600),
                      at_us(50'001),
                      at_us(50'100)});
  trace.releases.add({{8, at_us(66'000), at_us(66'000) + latency, true, ReleaseStream::kFrame},
                      true,
                      at_us(115'500),
                      at_us(115'600),
                      at_us(116'000),
                      at_us(116'100)});
  return trace;
}

std::vector<json> events_of(const FrameTrace& trace, std::optional<Instant> counted_from = std::nullopt) {
  return json::parse("[" + trace_events(3, "live: run 1", trace, counted_from, kZero) + "]").get<std::vector<json>>();
}

std::vector<json> those(const std::vector<json>& events, const std::string& phase, int thread) {
  std::vector<json> chosen;
  std::copy_if(events.begin(), events.end(), std::back_inserter(chosen), [&](const json& event) {
    return event["ph"] == phase && (thread == 0 || event.value("tid", 0) == thread);
  });
  return chosen;
}

std::vector<std::string> names(const std::vector<json>& events) {
  std::vector<std::string> all;
  for (const json& event : events) all.push_back(event["name"]);
  return all;
}

TEST(TraceEvents, TellTheirThreadsByName) {
  std::vector<std::string> threads;
  for (const json& event : events_of(made_trace())) {
    EXPECT_EQ(event["pid"], 3);
    if (event["name"] == "thread_name") threads.push_back(event["args"]["name"]);
    if (event["name"] == "process_name") {
      EXPECT_EQ(event["args"]["name"], "live: run 1");
    }
  }
  EXPECT_THAT(threads, ElementsAre("source", "mapper", "publisher", "worker-0", "worker-1"));
}

TEST(TraceEvents, TheMappersStagesLieWithinTheirFrame) {
  const std::vector<json> mapper = those(events_of(made_trace()), "X", 2);
  EXPECT_THAT(names(mapper), ElementsAre("await pose", "frame", "predict and find", "phase and pose", "evaluate",
                                         "settle matches", "hand on"));
  for (const json& slice : mapper) EXPECT_EQ(slice["args"]["frame"], 7);
  const double begin = mapper[1]["ts"];
  const double end = begin + mapper[1]["dur"].get<double>();
  double sum = 0.0;
  for (std::size_t i = 2; i < mapper.size(); ++i) {
    EXPECT_GE(mapper[i]["ts"].get<double>(), begin);
    EXPECT_LE(mapper[i]["ts"].get<double>() + mapper[i]["dur"].get<double>(), end + 0.004);
    sum += mapper[i]["dur"].get<double>();
  }
  EXPECT_NEAR(sum, mapper[1]["dur"].get<double>(), 1e-6);
}

TEST(TraceEvents, InstantsAreRightToTheNanosecond) {
  const std::string text = trace_events(1, "live", made_trace(), std::nullopt, kZero);
  EXPECT_THAT(text, HasSubstr("\"ts\":2013001.000,\"dur\":1999.789"));
  EXPECT_THAT(text, HasSubstr("\"ts\":2015000.789,\"dur\":99.211"));
}

TEST(TraceEvents, AFramesOwnTrackGoesFromItsCaptureToItsSurface) {
  std::vector<std::string> way;
  std::vector<double> ends;
  double last = 0.0;
  for (const json& event : events_of(made_trace())) {
    if (event.value("cat", "") != "frame" || event.value("id", 0) != 30'000'002) continue;
    if (event["ph"] == "b") way.push_back(event["name"]);
    if (event["ph"] == "n") {
      EXPECT_EQ(event["name"], "released");
      EXPECT_EQ(event["args"]["after_deadline_us"], 1.0);
      EXPECT_EQ(event["args"]["update_late"], false);
    }
    const bool on_track = event["ph"] == "b" || event["ph"] == "e" || event["ph"] == "n";
    if (!on_track) continue;
    EXPECT_GE(event["ts"].get<double>(), last) << "in order of time";
    last = event["ts"];
  }
  EXPECT_THAT(way,
              ElementsAre("frame", "on its way", "await taking over", "take over", "await mapper", "await pose",
                          "await mapper", "predict and find", "phase and pose", "evaluate", "await release", "write"));
  EXPECT_NEAR(last - 2e6, 50'100.0, 0.01);
}

TEST(TraceEvents, AFrameThatNobodyMappedAndASurfaceWithoutOneAreThere) {
  const std::vector<json> events = events_of(made_trace());
  std::vector<int> frames;
  for (const json& event : those(events, "b", 0)) {
    if (event["name"] == "frame") frames.push_back(event["args"]["frame"]);
  }
  EXPECT_THAT(frames, ElementsAre(7, 8));
  const std::vector<json> published = those(events, "X", 3);
  EXPECT_THAT(names(published),
              ElementsAre("compose", "await deadline", "write", "compose", "await deadline", "write"));
  EXPECT_EQ(published[2]["args"]["frame_missing"], false);
  EXPECT_EQ(published[5]["args"]["frame_missing"], true);
  EXPECT_EQ(published[5]["args"]["update_late"], true);
}

TEST(TraceEvents, ArrowsLeadFromTheTakingOverToTheStagesToTheSurface) {
  const std::vector<json> events = events_of(made_trace());
  for (const char* phase : {"s", "t", "f"}) {
    const std::vector<json> arrows = those(events, phase, 0);
    ASSERT_EQ(arrows.size(), 1U) << "frame 8 led to nothing";
    EXPECT_EQ(arrows[0]["id"], 30'000'002);
  }
}

TEST(TraceEvents, WhatIsCountedFromWhenIsMarked) {
  EXPECT_THAT(those(events_of(made_trace()), "i", 0), IsEmpty());
  const std::vector<json> marks = those(events_of(made_trace(), at_us(50'000)), "i", 0);
  ASSERT_EQ(marks.size(), 1U);
  EXPECT_EQ(marks[0]["name"], "counted from here");
}

TEST(TraceEvents, WhatHadNoRoomIsTold) {
  FrameTrace trace(1, 1);
  for (std::uint64_t i = 0; i < 3; ++i) trace.arrivals.add({{i, at_us(0), at_us(1)}, at_us(2), at_us(3)});
  EXPECT_EQ(trace.left_out(), 2U);
  EXPECT_THAT(trace_events(1, "live", trace, std::nullopt, kZero), HasSubstr("live (2 entries had no room)"));
}

}  // namespace
}  // namespace perimap::bench

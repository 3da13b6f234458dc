#include "core/pipeline/frame_stopwatch.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <thread>

namespace perimap {
namespace {

// A frame of some length through all laps.
void pass(FrameStopwatch& stopwatch, std::uint64_t frame) {
  const auto work = [] { std::this_thread::sleep_for(std::chrono::microseconds(100)); };
  stopwatch.begin(frame);
  work();
  stopwatch.found();
  work();
  stopwatch.settled();
  work();
  stopwatch.evaluated(Instant{});
  stopwatch.matches_settled();
  stopwatch.learning_begun();
  work();
  EXPECT_TRUE(stopwatch.learnt(MonotonicClock::now()));
}

// The trace and the figures of the status and of the benchmark are one measurement.
TEST(FrameStopwatch, TheTraceHasTheDurationsThatAreCounted) {
  const auto counters = std::make_unique<PipelineCounters>();
  FixedLog<FrameSlice> log(100);
  FrameStopwatch stopwatch(*counters, true, &log);
  pass(stopwatch, 41);
  const auto expect = [&](FramePart part, const LatencyHistogram& histogram) {
    int found = 0;
    for (const FrameSlice& slice : log.entries()) {
      if (slice.part != part) continue;
      ++found;
      EXPECT_EQ(slice.frame, 41U);
      EXPECT_EQ(slice.end - slice.begin, histogram.summary().max) << name_of(part);
    }
    EXPECT_EQ(found, 1) << name_of(part);
  };
  expect(FramePart::kPredictAndFind, counters->predict_and_find);
  expect(FramePart::kPhaseAndPose, counters->phase_and_pose);
  expect(FramePart::kEvaluate, counters->evaluate);
  expect(FramePart::kLearn, counters->learn);
  EXPECT_EQ(log.entries().size(), 6U);
  for (std::size_t i = 1; i < log.entries().size(); ++i)
    EXPECT_EQ(log.entries()[i].begin, log.entries()[i - 1].end) << "nothing is left out between two parts";
}

TEST(FrameStopwatch, WithoutALogItCounts) {
  const auto counters = std::make_unique<PipelineCounters>();
  FrameStopwatch stopwatch(*counters, true, nullptr);
  pass(stopwatch, 1);
  EXPECT_EQ(counters->frame_compute.summary().count, 1U);
}

}  // namespace
}  // namespace perimap

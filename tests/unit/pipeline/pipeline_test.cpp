// What the pipeline counts and tells of its releases, without threads.
#include "core/pipeline/pipeline.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "core/phase/respiratory_clock.hpp"
#include "core/pipeline/map_memory.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/release_plan.hpp"
#include "core/pipeline/sensor_entrance.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "core/pipeline/surface_state.hpp"

namespace perimap {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr Duration kPeriod = milliseconds(30);

PipelineSettings settings() {
  PipelineSettings s;
  s.camera.width = 64;
  s.camera.height = 48;
  s.camera.fx = s.camera.fy = 50.0;
  s.features.maximum = 8;
  s.latency = milliseconds(50);
  return s;
}

// Frame i is captured at i * kPeriod and arrives 12 ms later.
void let_in(Pipeline& pipeline, std::uint64_t frame) {
  static const std::vector<std::uint8_t> pixels(64 * 48, 100);
  const Instant capture = Instant(milliseconds(1000)) + static_cast<int>(frame) * kPeriod;
  const FrameStamp stamp{frame, capture, capture + milliseconds(12)};
  static_cast<void>(pipeline.entrance().push_frame(stamp, {pixels.data(), 64, 48, 64}));
  pipeline.drain_stamps(stamp.arrival);
}

TEST(Pipeline, CountsASurfaceOnceItIsSentSoThatNoCountIsEverLowered) {
  Pipeline pipeline(settings());
  const StreamCounters& counters = pipeline.counters().of(ReleaseStream::kFrame);
  for (std::uint64_t i = 0; i < 2; ++i) let_in(pipeline, i);
  const SurfaceSample& unsent = pipeline.compose(pipeline.plan().take_release());
  EXPECT_TRUE(unsent.update_late) << "nobody maps";
  EXPECT_EQ(counters.samples.get(), 0U);
  EXPECT_EQ(counters.samples_from_late_update.get(), 0U);
  pipeline.take_back(unsent);
  EXPECT_EQ(counters.samples.get(), 0U);
  EXPECT_EQ(counters.releases_missed.get(), 1U);
  pipeline.sent(pipeline.compose(pipeline.plan().take_release()));
  EXPECT_EQ(counters.samples.get(), 1U);
  EXPECT_EQ(counters.samples_from_late_update.get(), 1U);
  EXPECT_EQ(counters.samples_without_frame.get(), 0U);
  const SurfaceSample& without_frame = pipeline.compose(pipeline.plan().take_release());
  ASSERT_TRUE(without_frame.release.frame_missing);
  pipeline.sent(without_frame);
  EXPECT_EQ(counters.samples_without_frame.get(), 1U);
}

TEST(StreamCounters, AReleaseIsLateFromMoreThanHalfAMillisecondOn) {
  StreamCounters counters;
  for (const Duration punctual : {Duration(0), Duration(microseconds(20)), Duration(microseconds(500))}) {
    counters.count_tardiness(punctual);
  }
  EXPECT_EQ(counters.releases_late.get(), 0U);
  counters.count_tardiness(microseconds(500) + Duration(1));
  counters.count_tardiness(milliseconds(30));
  EXPECT_EQ(counters.releases_late.get(), 2U);
  EXPECT_EQ(counters.release_tardiness.summary().count, 5U) << "punctual ones too";
  EXPECT_EQ(counters.releases_missed.get(), 0U) << "they were written";
}

// The surface model is judged by it: see Pipeline::model_footing().
TEST(Pipeline, WhatIsOwedByNowDoesNotWaitForTheClocksNextRelease) {
  PipelineSettings s = settings();
  s.frame_stream = false;
  s.clock_period = std::chrono::seconds(1);
  Pipeline pipeline(s);
  const auto owed_at = [&](Instant now) {
    pipeline.leave_out_missed(now);
    return pipeline.counters().last_owed_sequence.get();
  };
  const Instant first(milliseconds(1000));
  for (std::uint64_t i = 0; i < 10; ++i) let_in(pipeline, i);
  EXPECT_EQ(owed_at(first + 9 * kPeriod + milliseconds(49)), 8U);
  EXPECT_EQ(owed_at(first + 9 * kPeriod + milliseconds(50)), 9U);
  EXPECT_EQ(owed_at(first + 30 * kPeriod), 9U) << "those that have not come are owed by nobody";
  // Of a publisher that was held up: the release at 2 s tells what was due by then.
  EXPECT_EQ(owed_at(first + milliseconds(1500)), 9U);
  const Release release = pipeline.plan().take_release();
  EXPECT_EQ(release.deadline, Instant(milliseconds(2000)));
  EXPECT_EQ(release.capture, first + 31 * kPeriod);
}

// A suspicion is the mapper's; what is recalled stands at once.
TEST(Pipeline, BreathingThatIsSuspectedReachesTheStatusAndEachSurfaceUntilThePatientIsForgotten) {
  Pipeline pipeline(settings());
  EXPECT_FALSE(pipeline.status_respiration().suspected);
  MapMemory memory;
  memory.respiration.clock.suspected = true;
  memory.last_capture = Instant(milliseconds(500));
  pipeline.recall(memory, Instant(milliseconds(1000)));
  const RespiratoryClock told = pipeline.status_respiration();
  EXPECT_TRUE(told.suspected);
  EXPECT_TRUE(pipeline.model_footing(told, Instant(milliseconds(1000))).breath_doubtful);
  pipeline.ask_to_forget();
  pipeline.forget_if_asked();
  EXPECT_FALSE(pipeline.status_respiration().suspected);
  EXPECT_EQ(pipeline.counters().maps_forgotten.get(), 1U);
}

}  // namespace
}  // namespace perimap

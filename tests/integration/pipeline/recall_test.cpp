// A map that was kept is gone on with, and one that was to be forgotten is gone.
#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "daemon/checkpoint/checkpoint_file.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "daemon/runtime/replay_setup.hpp"

namespace perimap {
namespace {

struct Unheard final : Publication {
  void surface(const perimap_Surface& /*sample*/) override {}
  void surface_model(const perimap_SurfaceModel& /*model*/) override {}
  void phase(const perimap_Phase& /*phase*/) override {}
  void status(const perimap_Status& /*status*/) override {}
};

ReplaySetup setup() {
  auto made = prepare_replay(PERIMAP_TEST_RECORDING, std::nullopt, ReadMode::kStrict);
  if (!made) throw std::runtime_error(made.error().error.message);
  made->pipeline.lockstep = true;
  // Few enough that every slot is kept once a second: the recording ends soon after the first are mapped.
  made->pipeline.features.maximum = 40;
  return std::move(*made);
}

// A run over the whole recording, and what one who keeps it has got of it.
struct EarlierRun {
  EarlierRun() : s(setup()), pipeline(s.pipeline), runtime(pipeline, s.identity, s.utc_minus_monotonic, unheard) {
    while (auto event = next()) {
      runtime.deliver(*event);
      for (const MapFeed::Entry& entry : pipeline.map_feed().front()) {
        if (entry.mapped) {
          features[entry.slot] = entry.feature;
        } else {
          features.erase(entry.slot);
        }
      }
      if (!pipeline.map_feed().front().empty()) pipeline.map_feed().give_back();
      EcgBlock block;
      while (pipeline.entrance().pop_heard_ecg(block)) memory.ecg.push_back(block);
    }
    for (auto& [slot, feature] : features) memory.features.push_back(feature);
    const PipelineCounters& counters = pipeline.counters();
    memory.last_capture = from_ns(static_cast<std::int64_t>(counters.last_release_capture_ns.get()));
    memory.last_frame_sequence = counters.last_release_sequence.get();
    memory.frame_period = Duration(static_cast<std::int64_t>(counters.frame_period_ns.get()));
  }
  std::optional<ReplayEvent> next() {
    auto event = s.reader.next();
    if (!event) throw std::runtime_error(event.error().message);
    return std::move(*event);
  }

  ReplaySetup s;
  Unheard unheard;
  Pipeline pipeline;
  LockstepRuntime runtime;
  std::map<std::size_t, FeatureMemory> features;
  MapMemory memory;
};

// What the map says without any frame: where each feature is at the release.
std::map<std::uint32_t, SurfaceFeature> surface_at(Pipeline& pipeline, const Release& release) {
  std::map<std::uint32_t, SurfaceFeature> surface;
  for (const SurfaceFeature& feature : pipeline.compose(release).features) surface[feature.id] = feature;
  return surface;
}

TEST(Recall, PublishesWhatTheEarlierRunWouldHave) {
  EarlierRun earlier;
  ASSERT_GT(earlier.memory.features.size(), 5U) << "the recording must have mapped some";
  Pipeline later(earlier.s.pipeline);
  const Instant now = earlier.memory.last_capture + earlier.s.pipeline.latency + std::chrono::milliseconds(400);
  later.recall(earlier.memory, now);
  const auto release = later.schedule().next();
  ASSERT_TRUE(release);
  EXPECT_TRUE(release->frame_missing);
  EXPECT_GT(release->deadline, now) << "the releases that were missed are not made up for";
  EXPECT_LE(release->deadline, now + earlier.memory.frame_period);
  EXPECT_GT(release->frame_sequence, earlier.memory.last_frame_sequence);

  const auto before = surface_at(earlier.pipeline, *release);
  const auto after = surface_at(later, *release);
  int compared = 0;
  for (const FeatureMemory& feature : earlier.memory.features) {
    ASSERT_TRUE(after.contains(feature.id));
    const SurfaceFeature& there = after.at(feature.id);
    EXPECT_NE(there.state, FeatureState::kInvalid) << "the phase is known again";
    if (!before.contains(feature.id)) continue;
    // The map went on learning after the feature was last taken; the phase is the same, from the same beats.
    EXPECT_LT((there.p_WF_mm - before.at(feature.id).p_WF_mm).norm(), 3.0);
    EXPECT_TRUE(there.covariance_W_mm2.allFinite());
    EXPECT_GT(there.covariance_W_mm2.trace(), 0.0);
    ++compared;
  }
  EXPECT_GT(compared, 5);
}

TEST(Recall, ForgettingLeavesNothingOfMapAndRhythm) {
  EarlierRun run;
  Release release{1'000'000, run.memory.last_capture, run.memory.last_capture + run.s.pipeline.latency, true};
  ASSERT_FALSE(surface_at(run.pipeline, release).empty());
  run.pipeline.ask_to_forget();
  run.pipeline.forget_if_asked();
  EXPECT_TRUE(surface_at(run.pipeline, release).empty());
  EXPECT_EQ(run.pipeline.counters().maps_forgotten.get(), 1U);
  for (const FeatureSlot& slot : run.pipeline.slots()) {
    EXPECT_TRUE(slot.state == SlotState::kEmpty || (slot.state == SlotState::kStarting && slot.forgotten));
  }
  EcgBlock block = run.memory.ecg.back();
  block.first_sample_time += block.count * block.sample_period;
  run.pipeline.entrance().push_ecg(block);
  EXPECT_EQ(run.pipeline.status_clock(block.first_sample_time).beats(), 0U);
}

TEST(Recall, TakesNoMoreFeaturesThanThereIsRoomForAndNoneOfAnotherLayout) {
  EarlierRun run;
  ASSERT_GT(run.memory.features.size(), 5U);
  run.memory.features[0].estimate.x.resize(3);
  run.memory.features[0].estimate.P.resize(3, 3);
  PipelineSettings settings = run.s.pipeline;
  settings.features.maximum = 4;
  Pipeline small(settings);
  small.recall(run.memory, run.memory.last_capture);
  int mapped = 0;
  for (const FeatureSlot& slot : small.slots()) {
    if (slot.state != SlotState::kMapped) continue;
    ++mapped;
    EXPECT_NE(slot.id, run.memory.features[0].id);
  }
  EXPECT_EQ(mapped, 4);
}

}  // namespace
}  // namespace perimap

// A breathing heart is followed; the run is cut off, and another goes on from what was kept. It publishes what the
// first, had it not been cut off, publishes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/pipeline/map_memory.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/checkpoint/checkpoint_file.hpp"
#include "daemon/checkpoint/warm_restart.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "tests/integration/pipeline/kept_map.hpp"
#include "tests/simulated/simulated_session.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// The surfaces, by when they were released: before the second run has a frame, its surfaces name none.
struct Surfaces final : Publication {
  struct One {
    perimap_SurfaceReason reason;
    std::map<std::uint32_t, Vector3d> p_W_mm;
  };
  std::map<Instant, One> released;

  void surface(const perimap_Surface& sample) override {
    One& one = released[from_ns(sample.release_time_ns)];
    one.reason = sample.reason;
    for (std::uint32_t i = 0; i < sample.features._length; ++i) {
      const perimap_SurfaceFeature& feature = sample.features._buffer[i];
      if (feature.state != perimap_FEATURE_CONVERGED) continue;
      one.p_W_mm[feature.id] = Vector3d(feature.position_W_mm[0], feature.position_W_mm[1], feature.position_W_mm[2]);
    }
  }
  // Frame times that go on from a period are rounded.
  [[nodiscard]] const One* at(Instant release) const {
    const auto found = released.lower_bound(release - milliseconds(1));
    return found != released.end() && found->first <= release + milliseconds(1) ? &found->second : nullptr;
  }
  void surface_model(const perimap_SurfaceModel& /*model*/) override {}
  void phase(const perimap_Phase& /*phase*/) override {}
  void status(const perimap_Status& /*status*/) override {}
};

// Through a checkpoint's bytes.
MapMemory kept_as_bytes(const MapMemory& memory, Instant saved) {
  Checkpoint checkpoint{{}, "boot", saved, 0, Duration(0), memory};
  std::vector<std::string> features;
  for (const FeatureMemory& feature : memory.features) features.push_back(serialize_feature(feature));
  const auto read = parse_checkpoint(serialize(checkpoint, features));
  if (!read) throw std::runtime_error(read.error().message);
  const auto usable = usable_memory(*read, {}, {"boot", saved, 0}, seconds(1));
  if (!usable) throw std::runtime_error(usable.error().message);
  return *usable;
}

struct Difference {
  int surfaces = 0;
  int breath_unknown = 0;
  std::vector<double> mm;

  [[nodiscard]] double quantile(double q) {
    std::sort(mm.begin(), mm.end());
    return mm.empty() ? INFINITY : mm[static_cast<std::size_t>(q * static_cast<double>(mm.size() - 1))];
  }
};

Difference compare(const Surfaces& whole, const Surfaces& after, Instant begin, Instant end) {
  Difference difference;
  for (const auto& [release, one] : after.released) {
    const Surfaces::One* other = whole.at(release);
    if (release < begin || release >= end || other == nullptr) continue;
    ++difference.surfaces;
    if (one.reason == perimap_SURFACE_REASON_RESPIRATION_UNKNOWN) ++difference.breath_unknown;
    for (const auto& [id, p_W_mm] : one.p_W_mm) {
      const auto there = other->p_W_mm.find(id);
      if (there != other->p_W_mm.end()) difference.mm.push_back((p_W_mm - there->second).norm());
    }
  }
  return difference;
}

TEST(RecallBreathing, WhatIsPublishedGoesOnAsIfTheRunHadNotBeenCutOff) {
  SimulationSettings settings;
  settings.seed = 5;
  settings.duration = seconds(40);
  settings.width = 320;
  settings.height = 240;
  settings.respiration_mm = 10.0;
  const Simulation simulation = test::simulation_of(settings);
  const PipelineSettings pipeline_settings = test::settings_for(simulation, {});
  const Instant first = simulation.frames().front().stamp.capture;
  const Instant cut_off = first + seconds(32);
  const Instant executed = cut_off + milliseconds(500);
  const Instant sources_back = cut_off + milliseconds(1500);

  Surfaces whole;
  Surfaces after;
  test::KeptMap kept;
  Pipeline uninterrupted(pipeline_settings);
  LockstepRuntime runtime(uninterrupted, {"theatre 3", ReleaseStream::kFrame, "tracker"}, Duration(0), whole);
  std::unique_ptr<Pipeline> recalled;
  std::unique_ptr<LockstepRuntime> recalled_runtime;
  test::for_each_arrival(simulation, [&](const Simulation::Arrival& arrival, const FrameEvent& frame) {
    if (arrival.arrival >= cut_off && !recalled) {
      ASSERT_EQ(uninterrupted.status_respiration().state, RespirationState::kLocked);
      recalled = std::make_unique<Pipeline>(pipeline_settings);
      recalled->recall(kept_as_bytes(kept.memory(uninterrupted.counters()), cut_off), executed);
      recalled_runtime = std::make_unique<LockstepRuntime>(
          *recalled, Identity{"theatre 3", ReleaseStream::kFrame, "tracker"}, Duration(0), after);
    }
    test::deliver(runtime, simulation, arrival, frame, {});
    if (!recalled) kept.take(uninterrupted);
    if (arrival.arrival >= sources_back) test::deliver(*recalled_runtime, simulation, arrival, frame, {});
  });
  ASSERT_TRUE(recalled);
  runtime.finish();
  recalled_runtime->finish();

  Difference blind = compare(whole, after, executed, sources_back);
  Difference seeing = compare(whole, after, sources_back + seconds(1), Instant::max());
  std::printf("without sources: %d surfaces, %zu positions, median %.2f mm, 95 %% %.2f mm apart\n", blind.surfaces,
              blind.mm.size(), blind.quantile(0.5), blind.quantile(0.95));
  std::printf("with them, from 1 s on: %d surfaces, %zu positions, median %.2f mm, 95 %% %.2f mm apart\n",
              seeing.surfaces, seeing.mm.size(), seeing.quantile(0.5), seeing.quantile(0.95));
  EXPECT_GT(blind.surfaces, 20);
  EXPECT_EQ(blind.breath_unknown, 0);
  EXPECT_GT(blind.mm.size(), 200U);
  EXPECT_LT(blind.quantile(0.5), 0.7);
  EXPECT_EQ(seeing.breath_unknown, 0);
  EXPECT_GT(seeing.mm.size(), 2000U);
  EXPECT_LT(seeing.quantile(0.5), 0.3);
  EXPECT_LT(seeing.quantile(0.95), 1.5);
}

}  // namespace
}  // namespace perimap

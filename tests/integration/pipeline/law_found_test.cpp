// A heart of uneven cycles that does not follow the law that is told at first: the first features' starts tell which it
// is, before any of them has a map.
#include <gtest/gtest.h>

#include <chrono>

#include "core/phase/cardiac_clock.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/shard_snapshot.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "drivers/standins/simulator/simulation.hpp"
#include "tests/integration/pipeline/collected_surfaces.hpp"
#include "tests/simulated/simulated_session.hpp"

namespace perimap {
namespace {

TEST(LawFound, ByWhatTheFirstFeaturesStartFrom) {
  SimulationSettings scene;
  scene.width = 400;
  scene.height = 300;
  scene.duration = std::chrono::seconds(14);
  scene.ecg_record = "119";
  scene.law = MotionLaw::kWarped;
  scene.seed = 2;
  const Simulation simulation = test::simulation_of(scene);
  Pipeline pipeline(test::settings_for(simulation, {}));
  test::CollectedSurfaces collected;
  LockstepRuntime runtime(pipeline, Identity{}, Duration(0), collected);
  PhaseLaw told = PhaseLaw::kLinear;
  bool mapped_before = false;
  test::for_each_arrival(simulation, [&](const Simulation::Arrival& arrival, const FrameEvent& frame) {
    test::deliver(runtime, simulation, arrival, frame, {});
    if (frame.pixels.empty() || told != PhaseLaw::kLinear) return;
    told = pipeline.status_clock(frame.stamp.arrival).law().law;
    if (told != PhaseLaw::kLinear) return;
    for (const ShardSnapshot* snapshot : pipeline.model_snapshots()) {
      mapped_before = mapped_before || !snapshot->features.empty();
    }
  });
  runtime.finish();
  EXPECT_EQ(told, PhaseLaw::kWarped);
  EXPECT_FALSE(mapped_before);
}

}  // namespace
}  // namespace perimap

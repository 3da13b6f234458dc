// Features are shed when the budget does not suffice, and that is said. The budget is the shortest there is, so that
// any machine overruns it.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "core/pipeline/load_shedding.hpp"
#include "core/pipeline/pipeline.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "tests/integration/pipeline/collected_surfaces.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using test::CollectedSurface;
using test::CollectedSurfaces;

struct Shed {
  std::uint64_t most = 0;  // at any time
  std::uint64_t most_tracked = 0;
  std::uint64_t times = 0;
  std::vector<CollectedSurface> surfaces;
};

ReplaySetup setup(bool shedding) {
  auto made = prepare_replay(PERIMAP_TEST_RECORDING, std::nullopt, ReadMode::kStrict);
  if (!made) throw std::runtime_error(made.error().error.message);
  made->pipeline.budget = std::chrono::microseconds(100);
  made->pipeline.shedding = shedding;
  return std::move(*made);
}

// The live pipeline, given the recording's frames so slowly that a busy machine too finds features in time.
Shed paced(bool shedding) {
  ReplaySetup s = setup(shedding);
  Pipeline pipeline(s.pipeline);
  CollectedSurfaces collected;
  LockstepRuntime runtime(pipeline, s.identity, s.utc_minus_monotonic, collected);
  const PipelineCounters& counters = pipeline.counters();
  Shed shed;
  for (auto event = s.reader.next(); event && *event; event = s.reader.next()) {
    runtime.deliver(**event);
    if (!std::holds_alternative<FrameEvent>(**event)) continue;
    std::this_thread::sleep_for(milliseconds(40));
    shed.most = std::max(shed.most, counters.features_shed.get());
    shed.most_tracked = std::max(shed.most_tracked, counters.features_tracked.get());
  }
  runtime.finish();
  shed.times = counters.times_shed.get();
  shed.surfaces = collected.of(ReleaseStream::kFrame);
  return shed;
}

TEST(LoadSheddingLive, IsReportedAndTheSurfacesGoOn) {
  const Shed shed = paced(true);
  if (shed.most_tracked <= LoadSheddingDecision::kLeast) GTEST_SKIP() << "too busy a machine: no features were found";
  EXPECT_GT(shed.times, 0U);
  EXPECT_GT(shed.most, 0U);
  ASSERT_GT(shed.surfaces.size(), 100U);
  for (std::size_t i = 0; i < shed.surfaces.size(); ++i) EXPECT_EQ(shed.surfaces[i].head.sample_sequence, i + 1);
}

TEST(LoadSheddingLive, IsOffWhenConfiguredSo) {
  const Shed shed = paced(false);
  EXPECT_EQ(shed.times, 0U);
  EXPECT_EQ(shed.most, 0U);
}

TEST(LoadSheddingLive, IsOffInLockstep) {
  ReplaySetup s = setup(true);
  s.pipeline.lockstep = true;
  Pipeline pipeline(s.pipeline);
  CollectedSurfaces collected;
  LockstepRuntime runtime(pipeline, s.identity, s.utc_minus_monotonic, collected);
  for (auto event = s.reader.next(); event && *event; event = s.reader.next()) runtime.deliver(**event);
  runtime.finish();
  EXPECT_EQ(pipeline.counters().times_shed.get(), 0U);
  for (const CollectedSurface& surface : collected.of(ReleaseStream::kFrame)) {
    for (const perimap_SurfaceFeature& f : surface.features) EXPECT_NE(f.reason, perimap_FEATURE_REASON_SHED);
  }
}

}  // namespace
}  // namespace perimap

// The lens is covered for a second: frames and poses go on and the ECG carries the phase, so that nothing but the
// pictures tells that the map is no longer seen.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/sight.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "drivers/simulator/simulation.hpp"
#include "tests/integration/pipeline/collected_surfaces.hpp"
#include "tests/simulated/simulated_session.hpp"

namespace perimap {
namespace {

using test::CollectedSurface;
using test::CollectedSurfaces;

constexpr Duration kCoveredAfter = std::chrono::seconds(8);
constexpr Duration kCovered = std::chrono::seconds(1);

struct Session {
  std::vector<CollectedSurface> surfaces;
  std::vector<SurfaceFooting> models;  // at the arrival of each frame that shows nothing
  Instant first_covered, first_shown;  // captures
};

Session lens_is_covered() {
  SimulationSettings scene;
  scene.width = 320;
  scene.height = 240;
  scene.duration = std::chrono::seconds(11);
  const Simulation simulation = test::simulation_of(scene);
  PipelineSettings settings = test::settings_for(simulation, {});
  // The law is known: within the scene's seconds the images could not tell, and no surface would be good.
  settings.law_from_image = false;
  Pipeline pipeline(settings);
  CollectedSurfaces collected;
  LockstepRuntime runtime(pipeline, Identity{}, Duration(0), collected);
  Session session;
  test::for_each_arrival(simulation, [&](const Simulation::Arrival& arrival, const FrameEvent& rendered) {
    FrameEvent frame = rendered;
    if (!frame.pixels.empty()) {
      const Instant capture = frame.stamp.capture;
      const Duration since = capture - simulation.start();
      if (since >= kCoveredAfter && since < kCoveredAfter + kCovered) {
        if (session.models.empty()) session.first_covered = capture;
        std::fill(frame.pixels.begin(), frame.pixels.end(), std::uint8_t{0});
        std::fill(frame.bgr.begin(), frame.bgr.end(), std::uint8_t{0});
        EXPECT_FALSE(pipeline.model_snapshots().empty());
        session.models.push_back(pipeline.model_footing(pipeline.status_respiration(), frame.stamp.arrival));
      } else if (!session.models.empty() && session.first_shown == Instant{}) {
        session.first_shown = capture;
      }
    }
    test::deliver(runtime, simulation, arrival, frame, {});
  });
  runtime.finish();
  session.surfaces = collected.of(ReleaseStream::kFrame);
  return session;
}

TEST(CoveredLens, NoSurfaceIsGoodHalfASecondAfterThePicturesShowNothing) {
  const Session session = lens_is_covered();
  int good_before = 0, blind = 0, good_again = 0;
  for (const CollectedSurface& surface : session.surfaces) {
    const Instant capture = from_ns(surface.head.capture_time_ns);
    const bool good = surface.head.state == perimap_SURFACE_GOOD;
    if (capture < session.first_covered) {
      good_before += good ? 1 : 0;
      EXPECT_NE(surface.head.reason, perimap_SURFACE_REASON_NOT_SEEN) << surface.head.frame_sequence;
    } else if (from_ns(surface.head.release_time_ns) >= session.first_shown) {
      // It rests on the newest frame that is mapped.
      good_again += good ? 1 : 0;
    } else if (capture - session.first_covered > Sight::kLately) {
      ++blind;
      EXPECT_EQ(surface.head.state, perimap_SURFACE_DEGRADED);
      EXPECT_EQ(surface.head.reason, perimap_SURFACE_REASON_NOT_SEEN);
      EXPECT_FALSE(surface.features.empty()) << "the map still predicts";
      for (const perimap_SurfaceFeature& feature : surface.features) {
        const Instant observed = from_ns(feature.last_observed_time_ns);
        EXPECT_TRUE(observed < session.first_covered || observed >= session.first_shown) << "in a black picture";
      }
    }
  }
  EXPECT_GT(good_before, 10);
  EXPECT_GT(blind, 10);
  EXPECT_GT(good_again, 10) << "it goes on where the pictures come back";
  ASSERT_FALSE(session.models.empty());
  EXPECT_FALSE(session.models.front().not_seen);
  EXPECT_TRUE(session.models.back().not_seen);
}

}  // namespace
}  // namespace perimap

// Frames and poses go on and the ECG carries the phase, so that nothing but the pictures tells that the map is no
// longer seen: the lens is covered, or the organ has been moved.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/phase/respiratory_clock.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/shard_snapshot.hpp"
#include "core/pipeline/sight.hpp"
#include "core/pipeline/surface_state.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "drivers/standins/simulator/simulation.hpp"
#include "tests/integration/pipeline/collected_surfaces.hpp"
#include "tests/simulated/simulated_session.hpp"

namespace perimap {
namespace {

using test::CollectedSurface;
using test::CollectedSurfaces;

constexpr Duration kChangedAfter = std::chrono::seconds(8);

struct Session {
  std::vector<CollectedSurface> surfaces;
  std::vector<SurfaceFooting> models;      // at the arrival of each changed frame
  Instant first_changed, first_unchanged;  // captures

  enum class Part { kBefore, kJustChanged, kChanged, kAfter };
  [[nodiscard]] Part part_of(const perimap_Surface& surface) const {
    const Instant capture = from_ns(surface.capture_time_ns);
    if (capture < first_changed) return Part::kBefore;
    // It rests on the newest frame that is mapped.
    if (from_ns(surface.release_time_ns) >= first_unchanged) return Part::kAfter;
    return capture - first_changed <= Sight::kLately ? Part::kJustChanged : Part::kChanged;
  }
};

using Change = std::function<void(FrameEvent&)>;

Session session_with(const Change& change, Duration changed_for) {
  SimulationSettings scene;
  scene.width = 320;
  scene.height = 240;
  scene.duration = kChangedAfter + changed_for + std::chrono::seconds(2);
  const Simulation simulation = test::simulation_of(scene);
  PipelineSettings settings = test::settings_for(simulation, {});
  // The law is known, so that no surface is degraded for its sake.
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
      if (since >= kChangedAfter && since < kChangedAfter + changed_for) {
        if (session.models.empty()) session.first_changed = capture;
        change(frame);
        EXPECT_FALSE(pipeline.model_snapshots().empty());
        session.models.push_back(pipeline.model_footing(pipeline.status_respiration(), frame.stamp.arrival));
      } else if (!session.models.empty() && session.first_unchanged == Instant{}) {
        session.first_unchanged = capture;
      }
    }
    test::deliver(runtime, simulation, arrival, frame, {});
  });
  runtime.finish();
  session.surfaces = collected.of(ReleaseStream::kFrame);
  return session;
}

TEST(OutOfSight, NoSurfaceIsGoodHalfASecondAfterTheLensIsCovered) {
  const Change cover = [](FrameEvent& frame) {
    std::fill(frame.pixels.begin(), frame.pixels.end(), std::uint8_t{0});
    std::fill(frame.bgr.begin(), frame.bgr.end(), std::uint8_t{0});
  };
  const Session session = session_with(cover, std::chrono::seconds(1));
  int good_before = 0, just_covered = 0, covered = 0, good_again = 0;
  for (const CollectedSurface& surface : session.surfaces) {
    const bool good = surface.head.state == perimap_SURFACE_GOOD;
    switch (session.part_of(surface.head)) {
      case Session::Part::kBefore:
        good_before += good ? 1 : 0;
        EXPECT_NE(surface.head.reason, perimap_SURFACE_REASON_NOT_SEEN) << surface.head.frame_sequence;
        break;
      case Session::Part::kJustChanged:
        ++just_covered;
        if (from_ns(surface.head.release_time_ns) - session.first_changed > Sight::kLately) break;
        EXPECT_NE(surface.head.reason, perimap_SURFACE_REASON_NOT_SEEN) << "as when smoke drifts by";
        break;
      case Session::Part::kChanged:
        ++covered;
        EXPECT_EQ(surface.head.state, perimap_SURFACE_DEGRADED);
        EXPECT_EQ(surface.head.reason, perimap_SURFACE_REASON_NOT_SEEN);
        EXPECT_FALSE(surface.features.empty()) << "the map still predicts";
        for (const perimap_SurfaceFeature& feature : surface.features) {
          const Instant observed = from_ns(feature.last_observed_time_ns);
          EXPECT_TRUE(observed < session.first_changed || observed >= session.first_unchanged) << "in a black picture";
        }
        break;
      case Session::Part::kAfter:
        good_again += good ? 1 : 0;
    }
  }
  EXPECT_GT(good_before, 10);
  EXPECT_GT(just_covered, 10);
  EXPECT_GT(covered, 10);
  EXPECT_GT(good_again, 10) << "it goes on where the pictures come back";
  ASSERT_FALSE(session.models.empty());
  EXPECT_FALSE(session.models.front().not_seen);
  EXPECT_TRUE(session.models.back().not_seen);
}

// For so long that new features start and converge where the organ is now.
TEST(OutOfSight, NoSurfaceIsGoodWhileTheOrganIsNotWhereTheMapHasIt) {
  const Change move = [](FrameEvent& frame) {
    constexpr std::ptrdiff_t kRight_px = 80;
    for (auto row = frame.pixels.begin(); row != frame.pixels.end(); row += frame.width) {
      std::rotate(row, row + frame.width - kRight_px, row + frame.width);
    }
    frame.bgr.clear();
  };
  const Session session = session_with(move, std::chrono::seconds(6));
  int moved = 0, not_seen = 0;
  for (const CollectedSurface& surface : session.surfaces) {
    if (session.part_of(surface.head) != Session::Part::kChanged) continue;
    ++moved;
    not_seen += surface.head.reason == perimap_SURFACE_REASON_NOT_SEEN ? 1 : 0;
    EXPECT_NE(surface.head.state, perimap_SURFACE_GOOD)
        << to_seconds(from_ns(surface.head.capture_time_ns) - session.first_changed) << " s after it moved";
  }
  EXPECT_GT(moved, 100);
  EXPECT_GT(not_seen, moved / 2);
}

}  // namespace
}  // namespace perimap

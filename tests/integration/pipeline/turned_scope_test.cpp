// An angled scope is turned in its camera head, or zoomed, during a session: where that is calibrated the surface stays
// right, and where it is not no surface is good.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <map>
#include <optional>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "drivers/standins/simulator/simulation.hpp"
#include "tests/integration/pipeline/collected_surfaces.hpp"
#include "tests/simulated/simulated_session.hpp"

namespace perimap {
namespace {

using test::CollectedSurface;
using test::CollectedSurfaces;

constexpr Duration kTurnedAt = std::chrono::seconds(14);
constexpr Duration kTurnTakes = std::chrono::seconds(1);
constexpr Duration kLength = std::chrono::seconds(28);
constexpr ScopeHeld kHeld{40.0 * kDegree, 1.0};

struct Session {
  std::vector<CollectedSurface> surfaces;
  Instant start;
  std::uint64_t turns = 0;
  std::uint64_t frames_unread = 0;
  // Of features called converged in good surfaces of the time, mm.
  std::vector<double> errors_mm;
  // Of those surfaces: how far off what they tell of their picture's lens is, the larger of focal lengths and principal
  // point, px.
  double lens_error_px = 0.0;

  [[nodiscard]] double error_mm(double share) const {
    std::vector<double> sorted = errors_mm;
    std::sort(sorted.begin(), sorted.end());
    return sorted.empty() ? 1e9 : sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  }
  [[nodiscard]] bool within(const CollectedSurface& surface, Duration from, Duration to) const {
    const Duration since = from_ns(surface.head.capture_time_ns) - start;
    return since >= from && since < to;
  }
  [[nodiscard]] int count(perimap_SurfaceState state, Duration from, Duration to) const {
    return static_cast<int>(std::count_if(surfaces.begin(), surfaces.end(), [&](const CollectedSurface& surface) {
      return surface.head.state == state && within(surface, from, to);
    }));
  }
};

// Where each mapped feature really is: by the ray in which it was found, through the lens as the scope was held then.
class Origins {
 public:
  explicit Origins(const Simulation& simulation) : simulation_(simulation) {}

  void note(const Pipeline& pipeline) {
    for (const FeatureSlot& slot : pipeline.slots()) {
      if (slot.state != SlotState::kMapped || points_.contains(slot.id)) continue;
      const auto X_WC = simulation_.truth().camera_pose(slot.first_observed);
      if (!X_WC) continue;
      const ScopeLens lens = simulation_.setup_at(slot.first_observed - simulation_.start()).lens;
      points_.emplace(slot.id,
                      simulation_.truth().first_hit(*X_WC, lens.ray(slot.first_observed_px), slot.first_observed));
    }
  }
  [[nodiscard]] std::optional<double> error_mm(const perimap_SurfaceFeature& feature, Instant valid) const {
    const auto found = points_.find(feature.id);
    if (found == points_.end() || !found->second) return std::nullopt;
    return (Vector3d(feature.position_W_mm) - simulation_.truth().position(*found->second, valid)).norm();
  }

 private:
  const Simulation& simulation_;
  std::map<std::uint32_t, std::optional<SurfacePoint>> points_;
};

struct Trial {
  std::optional<ScopeHeld> turn_to;
  bool calibrated = true;
  int workers = 1;
  bool second_sensor = false;  // tells the turn, in place of a field stop
  std::vector<SimulationSettings::Stretch> second_lost = {};
};

Session session_of(const Trial& trial) {
  SimulationSettings scene;
  scene.seed = 4711;
  scene.setup_seed = 929;
  scene.width = 320;
  scene.height = 240;
  scene.duration = kLength;
  scene.held = kHeld;
  if (trial.turn_to) scene.turn = SimulationSettings::Turn{kTurnedAt, *trial.turn_to, kTurnTakes};
  scene.scope_calibrated = trial.calibrated;
  scene.second_sensor = trial.second_sensor;
  scene.second_lost = trial.second_lost;
  const Simulation simulation = test::simulation_of(scene);
  const TrackerNoise noise{0.5, 0.2 * kDegree};
  PipelineSettings settings = test::settings_for(simulation, noise);
  settings.law_from_image = false;  // it is known, so that no surface is degraded for its sake
  settings.workers = trial.workers;
  Pipeline pipeline(settings);
  CollectedSurfaces collected;
  Session session;
  Origins origins(simulation);
  {
    LockstepRuntime runtime(pipeline, Identity{}, Duration(0), collected);
    test::for_each_arrival(simulation, [&](const Simulation::Arrival& arrival, const FrameEvent& frame) {
      test::deliver(runtime, simulation, arrival, frame, noise);
      if (arrival.source == Simulation::Source::kCamera) origins.note(pipeline);
    });
    runtime.finish();
  }
  session.surfaces = collected.of(ReleaseStream::kFrame);
  session.start = simulation.start();
  session.turns = pipeline.counters().scope_turns.get();
  session.frames_unread = pipeline.counters().scope_frames_unread.get();
  for (const CollectedSurface& surface : session.surfaces) {
    constexpr Duration kSettledAgain = std::chrono::seconds(3);
    if (surface.head.state != perimap_SURFACE_GOOD) continue;
    if (!session.within(surface, kTurnedAt + kSettledAgain, kLength)) continue;
    const ScopeLens lens = simulation.setup_at(from_ns(surface.head.capture_time_ns) - simulation.start()).lens;
    if (surface.head.camera_pose_known) {
      const Vector2d focal(surface.head.camera_focal_px);
      const Vector2d principal(surface.head.camera_principal_point_px);
      session.lens_error_px = std::max({session.lens_error_px, (focal - Vector2d(lens.fx, lens.fy)).norm(),
                                        (principal - Vector2d(lens.cx, lens.cy)).norm()});
    }
    for (const perimap_SurfaceFeature& feature : surface.features) {
      if (feature.state != perimap_FEATURE_CONVERGED) continue;
      const auto error = origins.error_mm(feature, from_ns(surface.head.valid_time_ns));
      if (error) session.errors_mm.push_back(*error);
    }
  }
  std::printf("good positions %zu, error %.3f mm, 95 %% %.3f mm; turns %d, frames unread %d, lens off by %.2f px\n",
              session.errors_mm.size(), session.error_mm(0.5), session.error_mm(0.95), static_cast<int>(session.turns),
              static_cast<int>(session.frames_unread), session.lens_error_px);
  return session;
}

const Session& held() {
  static const Session session = session_of({});
  return session;
}

TEST(TurnedScope, SurfaceStaysAsRightAsOfAScopeThatIsHeld) {
  const Session turned = session_of({ScopeHeld{95.0 * kDegree, 1.0}});
  EXPECT_EQ(turned.turns, 1U);
  EXPECT_GT(turned.frames_unread, 5U) << "while it is turned";
  EXPECT_LT(turned.frames_unread, 75U);
  EXPECT_GT(turned.count(perimap_SURFACE_GOOD, kTurnedAt + std::chrono::seconds(4), kLength), 200);
  EXPECT_LT(turned.error_mm(0.5), 1.3 * held().error_mm(0.5));
  EXPECT_LT(turned.error_mm(0.95), 1.3 * held().error_mm(0.95));
}

TEST(TurnedScope, ZoomedTooItStaysRight) {
  const Session zoomed = session_of({ScopeHeld{70.0 * kDegree, 1.08}});
  EXPECT_GE(zoomed.turns, 1U);
  EXPECT_LT(zoomed.error_mm(0.5), 1.3 * held().error_mm(0.5));
  EXPECT_LT(zoomed.lens_error_px, 1.0) << "whoever draws over the picture is told what the lens was";
}

TEST(TurnedScope, ASecondSensorTellsItAsWellAndNothingWhileItIsNotSeen) {
  constexpr Duration kLost = std::chrono::seconds(21);
  constexpr Duration kSeen = std::chrono::seconds(24);
  Trial trial{ScopeHeld{95.0 * kDegree, 1.0}};
  trial.second_sensor = true;
  trial.second_lost = {{kLost, kSeen - kLost}};
  const Session turned = session_of(trial);
  EXPECT_GE(turned.turns, 1U);
  EXPECT_GT(turned.count(perimap_SURFACE_GOOD, kTurnedAt + std::chrono::seconds(4), kLost), 60);
  EXPECT_LT(turned.error_mm(0.5), 1.3 * held().error_mm(0.5));
  EXPECT_LT(turned.error_mm(0.95), 1.3 * held().error_mm(0.95));
  EXPECT_LT(turned.lens_error_px, 1.0);
  // But for the poses that are carried on by 20 ms from the last ones.
  const Duration gone = kLost + std::chrono::milliseconds(100);
  // The last ones are released when it is seen again.
  EXPECT_EQ(turned.count(perimap_SURFACE_GOOD, gone, kSeen - std::chrono::milliseconds(100)), 0);
  for (const CollectedSurface& surface : turned.surfaces) {
    if (!turned.within(surface, gone, kSeen)) continue;
    EXPECT_FALSE(surface.head.camera_pose_known);
  }
  EXPECT_GT(turned.count(perimap_SURFACE_GOOD, kSeen + std::chrono::seconds(1), kLength), 60) << "seen again";
}

TEST(TurnedScope, NoSurfaceIsGoodWhereNobodyCalibratedThat) {
  const Session untold = session_of({ScopeHeld{95.0 * kDegree, 1.0}, false});
  EXPECT_EQ(untold.turns, 1U);
  EXPECT_GT(untold.count(perimap_SURFACE_GOOD, std::chrono::seconds(10), kTurnedAt), 20) << "before it is turned";
  // Two readings, a second apart each, that agree.
  const Duration told = kTurnedAt + kTurnTakes + std::chrono::milliseconds(2500);
  EXPECT_EQ(untold.count(perimap_SURFACE_GOOD, told, kLength), 0);
  for (const CollectedSurface& surface : untold.surfaces) {
    if (!untold.within(surface, told, kLength) || surface.head.state != perimap_SURFACE_DEGRADED) continue;
    EXPECT_FALSE(surface.head.camera_pose_known);
  }
}

TEST(TurnedScope, SurfacesAreTheSameForAnyNumberOfWorkers) {
  const ScopeHeld to{95.0 * kDegree, 1.0};
  const Session one = session_of({to, true, 1});
  const Session three = session_of({to, true, 3});
  ASSERT_EQ(one.surfaces.size(), three.surfaces.size());
  for (std::size_t i = 0; i < one.surfaces.size(); ++i) {
    const CollectedSurface& a = one.surfaces[i];
    const CollectedSurface& b = three.surfaces[i];
    ASSERT_EQ(a.head.state, b.head.state) << i;
    ASSERT_EQ(a.head.reason, b.head.reason) << i;
    ASSERT_EQ(a.features.size(), b.features.size()) << i;
    for (std::size_t k = 0; k < a.features.size(); ++k) {
      ASSERT_EQ(Vector3d(a.features[k].position_W_mm), Vector3d(b.features[k].position_W_mm)) << i << " " << k;
    }
  }
}

}  // namespace
}  // namespace perimap

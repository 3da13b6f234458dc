// The organ is moved, or the tracker errs as if it had been: the images are the same. The patient's tool tells which,
// and where it has gone with the organ the map is moved there and goes on; without a tool whoever knows has to say so.
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <map>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/evaluation/report/accuracy.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "drivers/standins/simulator/simulation.hpp"
#include "tests/simulated/simulated_session.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kMovedAt = seconds(14);
constexpr Duration kMovedFor = milliseconds(1500);
constexpr Duration kKnownAfter = seconds(2);
constexpr Duration kEnd = seconds(27);
constexpr TrackerNoise kNoise{0.5, 0.003};

// Judges what is published, and counts what it says since the organ has moved.
class Judge final : public Publication {
 public:
  Judge(const GroundTruth& truth, const CameraModel& camera, Instant begin, Instant moved)
      : accuracy_(truth, camera, begin), moved_(moved) {}

  // How far off surfaces are is asked once that it has moved can be known.
  void surface(const perimap_Surface& sample) override {
    if (from_ns(sample.capture_time_ns) > moved_ + kMovedFor + kKnownAfter) accuracy_.add(sample);
    if (from_ns(sample.capture_time_ns) < moved_) {
      good_before += sample.state == perimap_SURFACE_GOOD ? 1 : 0;
      return;
    }
    ++said[sample.reason];
    last_state = sample.state;
  }
  void surface_model(const perimap_SurfaceModel& model) override { accuracy_.add(model); }
  void phase(const perimap_Phase& /*phase*/) override {}
  void status(const perimap_Status& status) override { last_status = status; }

  [[nodiscard]] AccuracyReport report() const { return accuracy_.report(Duration(0)); }

  std::map<perimap_SurfaceReason, int> said;
  int good_before = 0;
  perimap_SurfaceState last_state = perimap_SURFACE_INVALID;
  perimap_Status last_status{};  // its sequences mean nothing

 private:
  Accuracy accuracy_;
  Instant moved_;
};

// A session in which that happens; `meanwhile` is asked before each of its frames.
class Session {
 public:
  Session(const Happening& what, Duration length, bool with_tool)
      : simulation_(test::simulation_of(scene(what, length, with_tool))),
        pipeline_(settings()),
        judge(simulation_.truth(), pipeline_.settings().camera, simulation_.frames().front().stamp.capture,
              simulation_.start() + kMovedAt) {}

  void run(const std::function<void(Duration, Pipeline&)>& meanwhile = {}) {
    LockstepRuntime runtime(pipeline_, Identity{}, Duration(0), judge);
    test::for_each_arrival(simulation_, [&](const Simulation::Arrival& arrival, const FrameEvent& frame) {
      if (meanwhile && !frame.pixels.empty()) meanwhile(frame.stamp.capture - simulation_.start(), pipeline_);
      test::deliver(runtime, simulation_, arrival, frame, kNoise);
    });
    runtime.finish();
  }
  [[nodiscard]] const PipelineCounters& counters() { return pipeline_.counters(); }

 private:
  static SimulationSettings scene(const Happening& what, Duration length, bool with_tool) {
    SimulationSettings scene;
    scene.width = 320;
    scene.height = 240;
    scene.frames_per_s = 15.0;
    scene.duration = kEnd;
    scene.tracker_dropouts_per_min = 0.0;
    scene.patient_tool = with_tool;
    scene.procedure.events.push_back({kMovedAt, length, what});
    return scene;
  }
  [[nodiscard]] PipelineSettings settings() const {
    PipelineSettings settings = test::settings_for(simulation_, kNoise);
    settings.law_from_image = false;  // so that no surface is degraded for the law's sake
    return settings;
  }

  Simulation simulation_;
  Pipeline pipeline_;

 public:
  Judge judge;
};

Retraction pulled_aside() {
  Retraction retraction;
  retraction.shift_mm = Vector3d(6.0, -3.0, 1.0);
  retraction.turn_deg = 3.0;
  return retraction;
}

TEST(OrganFollowed, WhoseToolHasMovedWithItIsSaidToHaveMovedAndIsGoodAgainWhereItRests) {
  Session session(pulled_aside(), kMovedFor, true);
  session.run();
  Judge& judge = session.judge;
  EXPECT_GT(judge.good_before, 30);
  EXPECT_GT(judge.said[perimap_SURFACE_REASON_ORGAN_MOVED], 10);
  EXPECT_EQ(judge.said[perimap_SURFACE_REASON_TRACKER_ERRS], 0);
  EXPECT_EQ(session.counters().maps_moved.get(), 1U);
  EXPECT_EQ(session.counters().moves_refused.get(), 0U);
  EXPECT_EQ(judge.last_state, perimap_SURFACE_GOOD);
  EXPECT_GT(judge.said[perimap_SURFACE_REASON_NONE], 60) << "good again within ten seconds of its end";
  const AccuracyReport report = judge.report();
  EXPECT_LT(report.good.off, report.good.count / 100);
  EXPECT_EQ(judge.last_status.times_displaced, 1U);
  EXPECT_EQ(judge.last_status.maps_moved, 1U);
}

TEST(OrganFollowed, WhoseToolHasNotMovedIsSeenByATrackerThatErrsAndTheMapStays) {
  Metal metal;
  metal.shift_mm = Vector3d(6.0, -3.0, 1.0);
  metal.turn_deg = 1.0;
  Session session(metal, seconds(9), true);
  session.run();
  Judge& judge = session.judge;
  EXPECT_GT(judge.said[perimap_SURFACE_REASON_TRACKER_ERRS], 30);
  EXPECT_EQ(judge.said[perimap_SURFACE_REASON_ORGAN_MOVED], 0);
  EXPECT_EQ(session.counters().maps_moved.get(), 0U);
  EXPECT_EQ(judge.last_state, perimap_SURFACE_GOOD) << "it errs no more";
  EXPECT_LT(judge.report().good.off, judge.report().good.count / 100);
}

TEST(OrganFollowed, WithoutAToolTheMapIsMovedWhenWhoeverKnowsSaysSoAndNotBeforeTheOrganRests) {
  Session session(pulled_aside(), kMovedFor, false);
  session.run([&](Duration since, Pipeline& pipeline) {
    const PipelineCounters& counters = pipeline.counters();
    const bool too_soon = since > kMovedAt + kMovedFor && counters.moves_refused.get() == 0;
    const bool at_rest = since > kMovedAt + seconds(9) && counters.maps_moved.get() == 0;
    if (too_soon || at_rest) pipeline.ask_to_move_map();
    pipeline.move_map_if_asked();
  });
  Judge& judge = session.judge;
  EXPECT_EQ(session.counters().moves_refused.get(), 1U);
  EXPECT_EQ(session.counters().maps_moved.get(), 1U);
  EXPECT_GT(judge.said[perimap_SURFACE_REASON_ORGAN_OR_TRACKER_MOVED], 60) << "until somebody says so";
  EXPECT_GT(judge.said[perimap_SURFACE_REASON_ORGAN_MOVED], 0) << "from then on until it has converged there";
  EXPECT_LT(judge.said[perimap_SURFACE_REASON_ORGAN_MOVED], 45);
  EXPECT_EQ(judge.last_state, perimap_SURFACE_GOOD);
  EXPECT_LT(judge.report().good.off, judge.report().good.count / 100);
}

}  // namespace
}  // namespace perimap

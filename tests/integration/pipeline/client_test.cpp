// A subscriber that evaluates the surface model gets what the pipeline itself would publish: through whole sessions, by
// way of the bytes that go over the wire.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <perimap_client.hpp>
#include <stdexcept>
#include <string>

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/surface_composer.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "daemon/publishing/model_moment.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/publishing/wire_model.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "daemon/runtime/model_moment.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "drivers/recording/cdr.hpp"
#include "tests/simulated/simulated_session.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr std::array kAhead = {milliseconds(0),   milliseconds(16),  milliseconds(50), milliseconds(133),
                               milliseconds(250), milliseconds(399), milliseconds(650)};

struct Figures {
  int features = 0, with_breath = 0, refused = 0, degraded = 0;
  double furthest_mm = 0.0, furthest_mm_per_s = 0.0, furthest_share_of_covariance = 0.0;
};

// Makes a model at each release and compares what the client makes of it with the composer's surface, at some horizons.
class Comparison final : public Publication {
 public:
  explicit Comparison(Pipeline& pipeline) : pipeline_(pipeline) {}

  void surface(const perimap_Surface& sample) override {
    const Instant now = from_ns(sample.release_time_ns);
    const CardiacClock clock = pipeline_.status_clock(now);
    const RespiratoryClock respiration = pipeline_.status_respiration();
    ModelMoment moment = model_moment(pipeline_, clock, respiration, now);
    moment.validity += milliseconds(500);
    const auto bytes = serializer_.serialize(wire_.fill(moment));
    if (!bytes) throw std::runtime_error(bytes.error().message);
    const auto received = deserialize<perimap_SurfaceModel>(*bytes);
    if (!received) throw std::runtime_error(received.error().message);
    for (const Duration ahead : kAhead) compare(**received, moment, ahead);
  }
  void surface_model(const perimap_SurfaceModel& /*model*/) override {}
  void phase(const perimap_Phase& /*phase*/) override {}
  void status(const perimap_Status& /*status*/) override {}

  Figures figures;

 private:
  void compare(const perimap_SurfaceModel& model, const ModelMoment& moment, Duration ahead) {
    const Instant t = moment.now + ahead;
    client::PredictedSurface there;
    client::predict(model, to_ns(t), to_ns(moment.now), {.degraded = true}, there);
    ComposerSettings settings{moment.layout, ahead, milliseconds(200), 400};
    SurfaceComposer composer(settings);
    // Without a frame, so that the covariance is the bound that the model carries.
    const SurfaceSample& here =
        composer.compose({0, moment.now, moment.now, true}, moment.clock, moment.respiration, moment.snapshots);
    if (here.state == SurfaceState::kInvalid || there.refusal != client::Refusal::kNone) {
      // A model that is lost before the horizon ends there.
      EXPECT_EQ(here.state, SurfaceState::kInvalid);
      EXPECT_NE(there.refusal, client::Refusal::kNone);
      EXPECT_TRUE(there.features.empty());
      ++figures.refused;
      return;
    }
    figures.degraded += there.state == perimap_SURFACE_DEGRADED ? 1 : 0;
    ASSERT_EQ(there.features.size(), here.features.size());
    for (std::size_t i = 0; i < here.features.size(); ++i) compare(there.features[i], here.features[i]);
    if (model.respiratory_clock.state == perimap_RESPIRATION_LOCKED)
      figures.with_breath += static_cast<int>(here.features.size());
  }

  void compare(const client::PredictedFeature& there, const SurfaceFeature& here) {
    ASSERT_EQ(there.id, here.id);
    ++figures.features;
    const Matrix3d& P = here.covariance_W_mm2;
    const double upper[6] = {P(0, 0), P(0, 1), P(0, 2), P(1, 1), P(1, 2), P(2, 2)};
    for (std::size_t j = 0; j < 6; ++j) {
      further(figures.furthest_share_of_covariance, (there.covariance_W_mm2[j] - upper[j]) / P.trace());
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<int>(k);
      further(figures.furthest_mm, there.position_W_mm[k] - here.p_WF_mm(axis));
      further(figures.furthest_mm_per_s, there.velocity_W_mm_per_s[k] - here.velocity_W_mm_per_s(axis));
    }
  }

  static void further(double& furthest, double difference) {
    furthest = std::isfinite(difference) ? std::max(furthest, std::abs(difference)) : INFINITY;
  }

  Pipeline& pipeline_;
  WireModel wire_{{"theatre 3", ReleaseStream::kFrame, "tracker"}};
  CdrSerializer serializer_;
};

// The wire's times are whole nanoseconds: a linear law loses nothing by that, a breath's phase does.
void expect_equal(const Figures& figures, double tolerance_mm) {
  std::printf(
      "%d positions, %d of them with a breath, furthest %.1e mm, %.1e mm/s, %.1e of the covariance; refused %d\n",
      figures.features, figures.with_breath, figures.furthest_mm, figures.furthest_mm_per_s,
      figures.furthest_share_of_covariance, figures.refused);
  EXPECT_GT(figures.refused, 0) << "before there is a map there is nothing to predict";
  EXPECT_LE(figures.furthest_mm, tolerance_mm);
  EXPECT_LE(figures.furthest_mm_per_s, 1000 * tolerance_mm);
  EXPECT_LE(figures.furthest_share_of_covariance, 1000 * tolerance_mm);
}

TEST(Client, PredictsARecordedHeartAsThePipelineDoes) {
  auto setup = prepare_replay(PERIMAP_TEST_RECORDING, std::nullopt, ReadMode::kStrict);
  ASSERT_TRUE(setup) << setup.error().error.message;
  setup->pipeline.lockstep = true;
  Pipeline pipeline(setup->pipeline);
  Comparison comparison(pipeline);
  LockstepRuntime runtime(pipeline, setup->identity, setup->utc_minus_monotonic, comparison);
  for (;;) {
    const auto event = setup->reader.next();
    ASSERT_TRUE(event) << event.error().message;
    if (!*event) break;
    runtime.deliver(**event);
  }
  runtime.finish();
  EXPECT_GT(comparison.figures.features, 1000);
  expect_equal(comparison.figures, 1e-9);
}

TEST(Client, PredictsABreathingHeartAsThePipelineDoes) {
  SimulationSettings settings;
  settings.seed = 5;
  settings.duration = std::chrono::seconds(45);
  settings.width = 320;
  settings.height = 240;
  settings.respiration_mm = 10.0;
  const Simulation simulation = test::simulation_of(settings);
  PipelineSettings pipeline_settings = test::settings_for(simulation, {});
  ASSERT_TRUE(pipeline_settings.respiration.enabled);
  Pipeline pipeline(pipeline_settings);
  Comparison comparison(pipeline);
  LockstepRuntime runtime(pipeline, {"theatre 3", ReleaseStream::kFrame, "tracker"}, Duration(0), comparison);
  test::for_each_arrival(simulation, [&](const Simulation::Arrival& arrival, const FrameEvent& frame) {
    test::deliver(runtime, simulation, arrival, frame, {});
  });
  runtime.finish();
  EXPECT_GT(comparison.figures.with_breath, 10000);
  EXPECT_GT(comparison.figures.degraded, 0) << "until the breath is known";
  expect_equal(comparison.figures, 1e-7);
}

}  // namespace
}  // namespace perimap

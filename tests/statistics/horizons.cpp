// How far displayed positions are off at the release and some time ahead, through the whole pipeline in lockstep: by
// what predicts the phase, by the ECG record that drives the heart and by the law that its motion follows.
#include <fmt/format.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/surface_composer.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/publishing/wire_surface.hpp"
#include "daemon/report/accuracy.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "drivers/simulator/simulation.hpp"
#include "goals.hpp"
#include "tests/simulated/simulated_session.hpp"

namespace perimap::test {
namespace {

using std::chrono::milliseconds;

constexpr std::array<Duration, 3> kHorizons{milliseconds(0), milliseconds(100), milliseconds(300)};
using Errors = std::array<double, kHorizons.size()>;  // RMS, mm

// Composes every release anew for each horizon, with all that is known at the release, and compares with the truth.
class Horizons final : public Publication {
 public:
  Horizons(const Simulation& simulation, const PipelineSettings& settings)
      : start_(simulation.frames().front().stamp.capture), pipeline_(std::make_unique<Pipeline>(settings)) {
    for (const Duration lead : kHorizons) {
      ComposerSettings composer;
      composer.layout = settings.estimator.layout;
      composer.lead = lead;
      composer.maximum_features = static_cast<std::size_t>(settings.features.maximum);
      ahead_.push_back(std::make_unique<Ahead>(composer, simulation.truth(), settings.camera, start_));
    }
    runtime_ = std::make_unique<LockstepRuntime>(*pipeline_, Identity{}, Duration(0), *this);
  }

  void surface(const perimap_Surface& sample) override {
    const Release release{sample.frame_sequence, from_ns(sample.capture_time_ns), from_ns(sample.release_time_ns),
                          sample.reason == perimap_SURFACE_REASON_FRAME_MISSING};
    const CardiacClock clock = pipeline_->status_clock(release.deadline);
    const RespiratoryClock respiration = pipeline_->status_respiration();
    const auto snapshots = pipeline_->model_snapshots();
    for (const auto& ahead : ahead_) {
      ahead->accuracy.add(ahead->wire.fill(ahead->composer.compose(release, clock, respiration, snapshots), {}));
    }
  }
  void surface_model(const perimap_SurfaceModel& model) override {
    for (const auto& ahead : ahead_) ahead->accuracy.add(model);
  }
  void phase(const perimap_Phase& phase) override { static_cast<void>(phase); }
  void status(const perimap_Status& status) override { static_cast<void>(status); }

  [[nodiscard]] LockstepRuntime& runtime() { return *runtime_; }
  [[nodiscard]] PhaseLaw law() { return pipeline_->status_clock(start_).law().law; }
  [[nodiscard]] Errors errors(std::size_t& features) const {
    Errors errors{};
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const AccuracyReport report = ahead_[i]->accuracy.report(Duration(0));
      errors[i] = report.settled.rms_mm;
      features = report.converged_at_15_s;
    }
    return errors;
  }

 private:
  struct Ahead {
    Ahead(const ComposerSettings& settings, const GroundTruth& truth, const CameraModel& camera, Instant start)
        : composer(settings), wire(Identity{}, settings.maximum_features), accuracy(truth, camera, start) {}
    SurfaceComposer composer;
    WireSurface wire;
    Accuracy accuracy;
  };

  Instant start_;
  std::unique_ptr<Pipeline> pipeline_;
  std::vector<std::unique_ptr<Ahead>> ahead_;
  std::unique_ptr<LockstepRuntime> runtime_;
};

struct Cell {
  std::string predictor;
  Errors errors{};
};

const char* name_of(PhaseLaw law) {
  switch (law) {
    case PhaseLaw::kWarped:
      return "warped";
    case PhaseLaw::kTimeLocked:
      return "time-locked";
    case PhaseLaw::kLinear:
      break;
  }
  return "linear";
}

PhaseLaw law_of(MotionLaw law) {
  switch (law) {
    case MotionLaw::kWarped:
      return PhaseLaw::kWarped;
    case MotionLaw::kTimeLocked:
      return PhaseLaw::kTimeLocked;
    case MotionLaw::kLinear:
      break;
  }
  return PhaseLaw::kLinear;
}

// The predictors that go by the ECG alone are told the law; with the images it has to be found.
std::vector<Cell> cells_of(const SimulationSettings& scene) {
  const Simulation simulation = simulation_of(scene);
  PipelineSettings with_image = settings_for(simulation, {});
  with_image.features.maximum = 60;
  PipelineSettings autoregressive = with_image;
  autoregressive.phase_from_image = false;
  autoregressive.law_from_image = false;
  autoregressive.clock.law.law = law_of(scene.law);
  PipelineSettings previous = autoregressive;
  previous.clock.predictor = RrMethod::kPrevious;

  std::vector<std::unique_ptr<Horizons>> sessions;
  for (const PipelineSettings& settings : {previous, autoregressive, with_image})
    sessions.push_back(std::make_unique<Horizons>(simulation, settings));
  for_each_arrival(simulation, [&](const Simulation::Arrival& arrival, const FrameEvent& frame) {
    for (const auto& session : sessions) deliver(session->runtime(), simulation, arrival, frame, {});
  });
  std::vector<Cell> cells;
  const std::array<std::string, 3> names{"previous cycle", "AR", "AR + image"};
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    sessions[i]->runtime().finish();
    std::size_t features = 0;
    const Errors errors = sessions[i]->errors(features);
    cells.push_back({fmt::format("{}, {}: {} ({} features, law {})", scene.ecg_record, name_of(law_of(scene.law)),
                                 names[i], features, name_of(sessions[i]->law())),
                     errors});
  }
  return cells;
}

}  // namespace

void displayed_ahead(const Extent& extent, const HeartMesh& /*heart*/, GoalReport& report) {
  GoalReport::heading("displayed positions, RMS mm, after the release by", {"0 ms", "100 ms", "300 ms"});
  const std::vector<std::string> records =
      extent.whole ? std::vector<std::string>{"100", "123", "119"} : std::vector<std::string>{"100"};
  const std::vector<MotionLaw> laws = extent.whole
                                          ? std::vector{MotionLaw::kLinear, MotionLaw::kWarped, MotionLaw::kTimeLocked}
                                          : std::vector{MotionLaw::kLinear};
  for (const std::string& record : records) {
    for (const MotionLaw law : laws) {
      SimulationSettings scene;
      scene.seed = extent.seed;
      scene.width = 400;
      scene.height = 300;
      scene.duration = std::chrono::seconds(extent.whole ? 60 : 30);
      scene.ecg_record = record;
      scene.law = law;
      const std::vector<Cell> cells = cells_of(scene);
      for (const Cell& cell : cells) {
        const bool judged = &cell == &cells.back() && record == "100" && law != MotionLaw::kTimeLocked;
        report.row(cell.predictor, {cell.errors.begin(), cell.errors.end()}, 0.0, judged ? 0.35 : 1e9);
      }
      const Errors& previous = cells[0].errors;
      const Errors& alone = cells[1].errors;
      const Errors& seen = cells[2].errors;
      for (std::size_t i = 0; i < kHorizons.size(); ++i) {
        const std::string where =
            fmt::format("  {} ms: with the image", std::chrono::duration_cast<milliseconds>(kHorizons[i]).count());
        constexpr std::array<double, 3> kGoal{0.10, 0.16, 0.35};
        if (record == "100" && law != MotionLaw::kTimeLocked) report.at_most(where + ", mm", kGoal[i], seen[i]);
        report.at_most(where + " / AR", 1.0, seen[i] / alone[i]);
        if (record == "100" && i < 2) report.at_most(where + " / previous cycle", 1.0 / 3.0, seen[i] / previous[i]);
      }
    }
  }
}

}  // namespace perimap::test

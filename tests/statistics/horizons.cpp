// How far displayed positions are off at the release and some time ahead, through the whole pipeline in lockstep: by
// what predicts the phase, by the ECG record that drives the heart and by the law that its motion follows.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <memory>
#include <optional>
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
#include "motion_laws.hpp"
#include "tests/simulated/simulated_session.hpp"

namespace perimap::test {
namespace {

using std::chrono::milliseconds;

constexpr std::array<Duration, 3> kHorizons{milliseconds(0), milliseconds(100), milliseconds(300)};
using Errors = std::array<double, kHorizons.size()>;  // RMS, mm

constexpr double kSpan_s = 10.0;

// What one session reached.
struct Cell {
  struct Span {
    double positions = 0.0;
    double square_sum_mm2 = 0.0;
    [[nodiscard]] double rms_mm() const { return positions > 0.0 ? std::sqrt(square_sum_mm2 / positions) : NAN; }
  };
  std::string title;
  Errors errors{};
  double nees = 0.0;        // NEES/3 at the release
  std::vector<Span> spans;  // of kSpan_s each, at the release
};

// Composes every release anew for each horizon, with all that is known at the release, and compares with the truth.
class Horizons final : public Publication {
 public:
  Horizons(const Simulation& simulation, const PipelineSettings& settings)
      : start_(simulation.frames().front().stamp.capture),
        law_(settings.clock.law.law),
        pipeline_(std::make_unique<Pipeline>(settings)) {
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
    if (clock.law().law != law_) {
      law_ = clock.law().law;
      law_changed_s_ = to_seconds(release.deadline - start_);
    }
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
  [[nodiscard]] Cell cell(const std::string& title) const {
    Cell cell;
    for (std::size_t i = 0; i < ahead_.size(); ++i) {
      const AccuracyReport report = ahead_[i]->accuracy.report(Duration(0));
      cell.errors[i] = report.settled.rms_mm;
      if (i > 0) continue;
      cell.nees = report.mean_nees;
      cell.title = fmt::format("{} ({} features, law {}{})", title, report.converged_at_15_s, name_of(law_),
                               law_changed_s_ ? fmt::format(" after {:.0f} s", *law_changed_s_) : "");
      for (const ErrorSpan& second : report.seconds) {
        const auto at = static_cast<std::size_t>(second.begin_s / kSpan_s);
        if (at >= cell.spans.size()) cell.spans.resize(at + 1);
        const auto positions = static_cast<double>(second.error.count);
        if (second.error.count == 0) continue;
        cell.spans[at].positions += positions;
        cell.spans[at].square_sum_mm2 += positions * second.error.rms_mm * second.error.rms_mm;
      }
    }
    return cell;
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
  PhaseLaw law_;
  std::optional<double> law_changed_s_;  // the last time, from the first frame on
  std::unique_ptr<Pipeline> pipeline_;
  std::vector<std::unique_ptr<Ahead>> ahead_;
  std::unique_ptr<LockstepRuntime> runtime_;
};

// The predictors that go by the ECG alone are told the law; with the images it has to be found, or is told too.
std::array<Cell, 4> cells_of(const SimulationSettings& scene) {
  const Simulation simulation = simulation_of(scene);
  PipelineSettings with_image = settings_for(simulation, {});
  with_image.features.maximum = 60;
  PipelineSettings told = with_image;
  told.law_from_image = false;
  told.clock.law.law = law_of(scene.law);
  PipelineSettings autoregressive = told;
  autoregressive.phase_from_image = false;
  PipelineSettings previous = autoregressive;
  previous.clock.predictor = RrMethod::kPrevious;

  const std::array<PipelineSettings, 4> settings{previous, autoregressive, with_image, told};
  const std::array<std::string, 4> names{"previous cycle", "AR", "AR + image", "AR + image, told"};
  std::array<std::unique_ptr<Horizons>, 4> sessions;
  for (std::size_t i = 0; i < sessions.size(); ++i) sessions[i] = std::make_unique<Horizons>(simulation, settings[i]);
  for_each_arrival(simulation, [&](const Simulation::Arrival& arrival, const FrameEvent& frame) {
    for (const auto& session : sessions) deliver(session->runtime(), simulation, arrival, frame, {});
  });
  std::array<Cell, 4> cells;
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    sessions[i]->runtime().finish();
    cells[i] = sessions[i]->cell(names[i]);
  }
  return cells;
}

void judge(const SimulationSettings& scene, GoalReport& report) {
  const std::array<Cell, 4> cells = cells_of(scene);
  const auto& [previous, alone, seen, told] = cells;
  GoalReport::heading(
      fmt::format("{}, {}, {}x{}", scene.ecg_record, name_of(law_of(scene.law)), scene.width, scene.height),
      {"0 ms", "100 ms", "300 ms", "NEES/3"});
  for (const Cell& cell : cells) {
    GoalReport::line_of(cell.title, {cell.errors[0], cell.errors[1], cell.errors[2], cell.nees});
  }
  for (const Cell* cell : {&seen, &told}) {
    std::vector<double> by_span;
    for (const Cell::Span& span : cell->spans) by_span.push_back(span.rms_mm());
    GoalReport::line_of(fmt::format("  law {}: each {:g} s", cell == &told ? "told" : "found", kSpan_s), by_span);
  }
  for (std::size_t i = 0; i < kHorizons.size(); ++i) {
    const std::string where =
        fmt::format("  {} ms: with the image", std::chrono::duration_cast<milliseconds>(kHorizons[i]).count());
    constexpr std::array<double, 3> kGoal{0.10, 0.16, 0.35};
    if (scene.ecg_record == "100" && scene.law != MotionLaw::kTimeLocked)
      report.at_most(where + ", law found, mm", kGoal[i], seen.errors[i]);
    // That is told the law.
    report.at_most(where + ", law found / AR", 1.0, seen.errors[i] / alone.errors[i]);
    report.at_most(where + ", law told / AR", 1.0, told.errors[i] / alone.errors[i]);
    if (scene.ecg_record == "100" && i < 2)
      report.at_most(where + ", law found / previous cycle", 1.0 / 3.0, seen.errors[i] / previous.errors[i]);
  }
}

}  // namespace

void displayed_ahead(const Extent& extent, const HeartMesh& /*heart*/, GoalReport& report) {
  const HorizonScenes& asked = extent.horizons;
  std::vector<std::string> records = asked.records;
  if (records.empty())
    records =
        extent.whole ? std::vector<std::string>{"100", "119", "123", "03700181"} : std::vector<std::string>{"100"};
  std::vector<MotionLaw> laws = asked.laws;
  if (laws.empty()) {
    laws = extent.whole ? std::vector{MotionLaw::kLinear, MotionLaw::kWarped, MotionLaw::kTimeLocked}
                        : std::vector{MotionLaw::kLinear};
  }
  fmt::print("Displayed positions, RMS mm, after the release by:\n");
  for (const std::string& record : records) {
    for (const MotionLaw law : laws) {
      SimulationSettings scene;
      scene.seed = extent.seed;
      scene.width = asked.width;
      scene.height = asked.height;
      const int usual_s = extent.whole ? 60 : 30;
      scene.duration = std::chrono::seconds(asked.duration_s > 0 ? asked.duration_s : usual_s);
      scene.ecg_record = record;
      scene.law = law;
      judge(scene, report);
    }
  }
}

}  // namespace perimap::test

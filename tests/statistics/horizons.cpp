// How far displayed positions are off at the release and some time ahead, through the whole pipeline in lockstep: by
// what predicts the phase, by the ECG record that drives the heart and by the law that its motion follows.
#include <fmt/format.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "drivers/standins/simulator/simulation.hpp"
#include "goals.hpp"
#include "horizon_session.hpp"
#include "motion_laws.hpp"
#include "tests/simulated/simulated_session.hpp"

namespace perimap::test {
namespace {

using std::chrono::milliseconds;

constexpr std::array<Duration, 3> kHorizons{milliseconds(0), milliseconds(100), milliseconds(300)};

// What one session reached.
struct Cell {
  std::string title;
  std::vector<HorizonErrors> errors;  // of kHorizons
};

// Told the law of the motion and not told it, by the ECG alone, which then takes it for linear, and with the images,
// which then have to show it.
std::array<Cell, 5> cells_of(const SimulationSettings& scene) {
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

  PipelineSettings not_told = autoregressive;
  not_told.clock.law.law = with_image.clock.law.law;

  const std::array<PipelineSettings, 5> settings{previous, autoregressive, with_image, told, not_told};
  const std::array<std::string, 5> names{"previous cycle, told", "AR, told", "AR + image", "AR + image, told", "AR"};
  std::array<std::unique_ptr<HorizonSession>, 5> sessions;
  for (std::size_t i = 0; i < sessions.size(); ++i)
    sessions[i] =
        std::make_unique<HorizonSession>(simulation, settings[i], std::vector(kHorizons.begin(), kHorizons.end()));
  for_each_arrival(simulation, [&](const Simulation::Arrival& arrival, const FrameEvent& frame) {
    for (const auto& session : sessions) deliver(session->runtime(), simulation, arrival, frame, {});
  });
  std::array<Cell, 5> cells;
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    sessions[i]->runtime().finish();
    cells[i] = {fmt::format("{} ({})", names[i], sessions[i]->description()), sessions[i]->errors()};
  }
  return cells;
}

void judge(const SimulationSettings& scene, GoalReport& report) {
  const std::array<Cell, 5> cells = cells_of(scene);
  const auto& [previous, alone, seen, told, alone_not_told] = cells;
  GoalReport::heading(
      fmt::format("{}, {}, {}x{}", scene.ecg_record, name_of(law_of(scene.law)), scene.width, scene.height),
      {"0 ms", "100 ms", "300 ms", "NEES/3"});
  for (const Cell& cell : cells) {
    GoalReport::line_of(cell.title,
                        {cell.errors[0].rms_mm, cell.errors[1].rms_mm, cell.errors[2].rms_mm, cell.errors[0].nees});
  }
  for (const Cell* cell : {&seen, &told}) {
    GoalReport::line_of(fmt::format("  law {}: each {:g} s", cell == &told ? "told" : "found", HorizonErrors::kSpan_s),
                        cell->errors[0].rms_by_span());
  }
  for (std::size_t i = 0; i < kHorizons.size(); ++i) {
    const std::string where =
        fmt::format("  {} ms: with the image", std::chrono::duration_cast<milliseconds>(kHorizons[i]).count());
    constexpr std::array<double, 3> kGoal{0.10, 0.16, 0.35};
    if (scene.ecg_record == "100" && scene.law != MotionLaw::kTimeLocked)
      report.at_most(where + ", law found, mm", kGoal[i], seen.errors[i].rms_mm);
    report.at_most(where + ", law found / AR", 1.0, seen.errors[i].rms_mm / alone_not_told.errors[i].rms_mm);
    report.at_most(where + ", law told / AR told", 1.0, told.errors[i].rms_mm / alone.errors[i].rms_mm);
    // The other is told what this has to find.
    report.at_most(where + ", law found / AR told", 1.0, seen.errors[i].rms_mm / alone.errors[i].rms_mm);
    if (scene.ecg_record == "100" && i < 2)
      report.at_most(where + ", law found / previous cycle", 1.0 / 3.0,
                     seen.errors[i].rms_mm / previous.errors[i].rms_mm);
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

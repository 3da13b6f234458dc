// A heart that a ventilator moves too, through the whole pipeline in lockstep: nothing tells of the breathing but the
// images. How far the map's path is off, and what is displayed.
#include <fmt/format.h>

#include <chrono>
#include <string>
#include <vector>

#include "drivers/simulator/simulation.hpp"
#include "goals.hpp"
#include "horizon_session.hpp"
#include "tests/simulated/simulated_session.hpp"

namespace perimap::test {

void ventilated(const Extent& extent, const HeartMesh& /*heart*/, GoalReport& report) {
  // Two seconds back cardiac cycles are completed, and the filter of the breath's phase has seen what came after.
  const std::vector<Duration> horizons{std::chrono::seconds(-2), Duration(0)};
  constexpr std::size_t kLearnt = 2;  // spans of 10 s
  std::vector<std::string> records{"100"};
  if (extent.whole) records = {"100", "123", "03700181"};
  for (const std::string& record : records) {
    SimulationSettings scene;
    scene.seed = extent.seed;
    scene.width = 640;
    scene.height = 480;
    scene.duration = std::chrono::seconds(extent.whole ? 60 : 40);
    scene.ecg_record = record;
    scene.respiration_mm = 10.0;
    scene.respiration_period = std::chrono::seconds(4);
    const Simulation simulation = simulation_of(scene);
    PipelineSettings settings = settings_for(simulation, {});
    settings.features.maximum = 60;
    HorizonSession session(simulation, settings, horizons);
    for_each_arrival(simulation, [&](const Simulation::Arrival& arrival, const FrameEvent& frame) {
      deliver(session.runtime(), simulation, arrival, frame, {});
    });
    session.runtime().finish();
    const std::vector<HorizonErrors> errors = session.errors();
    GoalReport::heading(fmt::format("{}, ventilated, 10 mm every 4 s ({})", record, session.description()), {});
    report.at_most("  path from 20 s on, mm RMS", 0.1, errors[0].rms_from(kLearnt));
    report.at_most("  displayed from 20 s on, mm RMS", 0.3, errors[1].rms_from(kLearnt));
    report.shown("  NEES/3 of the path", "", errors[0].nees);
    report.shown("  NEES/3 of what is displayed", "", errors[1].nees);
    for (const HorizonErrors& at : errors) {
      std::vector<double> by_span;
      for (const HorizonErrors::Span& span : at.spans) by_span.push_back(span.rms_mm());
      GoalReport::line_of(
          fmt::format("  {}: each {:g} s", &at == &errors[0] ? "path" : "displayed", HorizonErrors::kSpan_s), by_span);
    }
  }
}

}  // namespace perimap::test

// A heart that a ventilator moves too, through the whole pipeline in lockstep: nothing tells of the breathing but the
// images.
#include <fmt/format.h>

#include <chrono>
#include <string>
#include <vector>

#include "drivers/standins/simulator/simulation.hpp"
#include "goals.hpp"
#include "horizon_session.hpp"
#include "tests/simulated/simulated_session.hpp"

namespace perimap::test {

void ventilated(const Extent& extent, const HeartMesh& /*heart*/, GoalReport& report) {
  constexpr std::size_t kLearning = 2;  // spans of 10 s: until here breathing is searched for and maps begin
  std::vector<std::string> records{"100"};
  if (extent.whole) records = {"100", "123", "03700181"};
  for (const std::string& record : records) {
    SimulationSettings scene;
    scene.seed = extent.seed;
    scene.width = 640;
    scene.height = 480;
    scene.duration = std::chrono::seconds(extent.whole ? 60 : 50);
    scene.ecg_record = record;
    scene.respiration_mm = 10.0;
    scene.respiration_period = std::chrono::seconds(4);
    const Simulation simulation = simulation_of(scene);
    PipelineSettings settings = settings_for(simulation, {});
    settings.features.maximum = 60;
    HorizonSession session(simulation, settings, {Duration(0)});
    for_each_arrival(simulation, [&](const Simulation::Arrival& arrival, const FrameEvent& frame) {
      deliver(session.runtime(), simulation, arrival, frame, {});
    });
    session.runtime().finish();
    const HorizonErrors errors = session.errors().front();
    const auto last = static_cast<std::size_t>(to_seconds(scene.duration) / HorizonErrors::kSpan_s) - 1;
    GoalReport::heading(fmt::format("{}, ventilated, 10 mm every 4 s ({})", record, session.description()), {});
    report.at_most("  displayed and called good, mm RMS", 0.3, errors.good.rms_mm);
    report.at_most("  of these off by more than 3 mm", 0, static_cast<double>(errors.good.off));
    // What is displayed holds the errors of both phases besides.
    report.at_most("  the path in the last 10 s, at most", 0.1, errors.rms_from(last));
    report.shown("  all from 20 s on, premature beats too", "", errors.rms_from(kLearning));
    report.shown("  NEES/3", "", errors.nees);
    GoalReport::line_of(fmt::format("  each {:g} s", HorizonErrors::kSpan_s), errors.rms_by_span());
  }
}

}  // namespace perimap::test

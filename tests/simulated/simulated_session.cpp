#include "tests/simulated/simulated_session.hpp"

#include <algorithm>
#include <stdexcept>
#include <thread>
#include <utility>

#include "daemon/config/configuration_loader.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "drivers/calibration/calibration_file.hpp"
#include "drivers/standins/session/calibrated_scope.hpp"
#include "drivers/standins/session/session_writer.hpp"
#include "drivers/standins/simulator/frame_renderer.hpp"

namespace perimap::test {
namespace {

template <typename T>
T value_of(Expected<T> made) {
  if (!made) throw std::runtime_error(made.error().message);
  return std::move(*made);
}

}  // namespace

unsigned all_processors() { return std::max(1U, std::thread::hardware_concurrency()); }

Simulation simulation_of(const SimulationSettings& settings) {
  return value_of(Simulation::create(settings, threaded_for(all_processors())));
}

PipelineSettings settings_for(const Simulation& simulation, const TrackerNoise& noise) {
  const auto configuration =
      value_of(parse_configuration(simulated_configuration(simulation, noise), "simulated.toml"));
  const auto camera =
      value_of(parse_calibration(simulation.setup_at(Duration(0)).lens.opencv_yaml(), "simulated.yaml"));
  PipelineSettings settings = pipeline_settings(configuration, camera);
  settings.turned_scope = value_of(calibrated_scope(simulation));
  settings.lockstep = true;
  return settings;
}

void for_each_arrival(const Simulation& simulation,
                      const std::function<void(const Simulation::Arrival&, const FrameEvent&)>& take) {
  FrameRenderer frames(simulation, all_processors());
  for (const Simulation::Arrival& arrival : simulation.arrivals()) {
    FrameEvent frame;
    if (arrival.source == Simulation::Source::kCamera) {
      const auto pixels = frames.next();
      frame.stamp = simulation.frames()[arrival.index].stamp;
      frame.width = simulation.settings().width;
      frame.height = simulation.settings().height;
      frame.pixels.assign(pixels.begin(), pixels.end());
    }
    take(arrival, frame);
  }
}

void deliver(LockstepRuntime& runtime, const Simulation& simulation, const Simulation::Arrival& arrival,
             const FrameEvent& frame, const TrackerNoise& noise) {
  switch (arrival.source) {
    case Simulation::Source::kCamera:
      runtime.deliver(frame);
      break;
    case Simulation::Source::kTracker:
      runtime.deliver(simulation.tracker_sample(arrival.index, noise));
      if (simulation.settings().patient_tool) {
        runtime.deliver(ToolPose{ToolRole::kPatient, simulation.patient_sample(arrival.index, noise)});
      }
      if (simulation.settings().second_sensor) {
        runtime.deliver(ToolPose{ToolRole::kSecondSensor, simulation.second_sample(arrival.index, noise)});
      }
      break;
    case Simulation::Source::kEcg:
      runtime.deliver(simulation.ecg()[arrival.index]);
      break;
    case Simulation::Source::kRespiration:
      runtime.deliver(simulation.respiration()[arrival.index]);
      break;
  }
}

}  // namespace perimap::test

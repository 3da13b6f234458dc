// A simulated session without a recording: what is sent arrives in its order, the pictures rendered on the way.
#pragma once

#include <functional>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "drivers/standins/simulator/simulation.hpp"

namespace perimap::test {

// As many threads as there are processors.
[[nodiscard]] unsigned all_processors();

// The simulation, made on all processors. Throws std::runtime_error when the settings are wrong.
[[nodiscard]] Simulation simulation_of(const SimulationSettings& settings);

// In lockstep, and else as a recording of this session would set the pipeline up. Throws std::runtime_error.
[[nodiscard]] PipelineSettings settings_for(const Simulation& simulation, const TrackerNoise& noise);

// `take` gets every arrival; the frame has its pixels when the arrival is the camera's, and is empty otherwise.
void for_each_arrival(const Simulation& simulation,
                      const std::function<void(const Simulation::Arrival&, const FrameEvent&)>& take);

// Hands the arrival on as it came; the tracker with this noise.
void deliver(LockstepRuntime& runtime, const Simulation& simulation, const Simulation::Arrival& arrival,
             const FrameEvent& frame, const TrackerNoise& noise);

}  // namespace perimap::test

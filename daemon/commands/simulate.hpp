// `perimap simulate`: writes a recording of a beating heart with its ground truth.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "drivers/simulator/simulation.hpp"

namespace CLI {
class App;
}

namespace perimap {

struct SimulatedRecording {
  std::filesystem::path path;
  TrackerNoise noise;
};

// What perimapd needs to know about this session, as a configuration file.
[[nodiscard]] std::string simulated_configuration(const Simulation& simulation, const TrackerNoise& noise);

// Renders the simulation once, on so many threads, and writes one recording for each tracker noise. Equal simulations
// give equal bytes, whatever the number of threads. Each file gets its name only when it is whole. `progress` hears of
// every frame.
[[nodiscard]] Expected<void> write_simulation(const Simulation& simulation,
                                              const std::vector<SimulatedRecording>& recordings, unsigned threads,
                                              const std::function<void(std::uint64_t frames)>& progress);

// Adds the subcommand. When it has run, `exit_code` is 0; 1 when the recording could not be written; 2 when an option
// was wrong.
void add_simulate_command(CLI::App& app, int& exit_code);

}  // namespace perimap

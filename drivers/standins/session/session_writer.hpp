// A simulated session as recordings: what the sensors give, the truth, and what perimapd needs to know about it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "drivers/standins/simulator/simulation.hpp"

namespace perimap {

struct SimulatedRecording {
  std::filesystem::path path;
  TrackerNoise noise;
  // Whether lens, hand-eye, clocks and noise are attached; where not, it is as of devices that nobody has measured.
  bool set_up_told = true;
  // A probe is tracked beside the scope (SimulatedTool), with its truth and, where the set-up is told, its tip.
  bool tool = false;
};

// What perimapd needs to know about this session, as a configuration file.
[[nodiscard]] std::string simulated_configuration(const Simulation& simulation, const TrackerNoise& noise);

// Renders the simulation once, on so many threads, and writes so many recordings of it. Equal simulations
// give equal bytes, whatever the number of threads. Each file gets its name only when it is whole. `progress` hears of
// every frame and says whether to go on; where not, nothing is left and false is returned.
[[nodiscard]] Expected<bool> write_simulation(const Simulation& simulation,
                                              const std::vector<SimulatedRecording>& recordings, unsigned threads,
                                              const std::function<bool(std::uint64_t frames)>& progress);

// The same recording but for the camera's pictures, whose channel stays empty: what a replay reads that has the
// pictures from elsewhere.
[[nodiscard]] Expected<void> write_without_pictures(const Simulation& simulation, const SimulatedRecording& recording);

}  // namespace perimap

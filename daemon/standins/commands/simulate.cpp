// `perimap simulate`: a recording of a beating heart with its ground truth.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <system_error>
#include <thread>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/command_line/progress.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/standins/commands/simulation_options.hpp"
#include "drivers/standins/session/session_writer.hpp"
#include "drivers/standins/simulator/frame_renderer.hpp"

namespace perimap {
namespace {

// What the command line gave.
struct Options {
  std::filesystem::path out;
  SimulationOptions simulation;
  std::vector<double> tracker_noises_mm;
  unsigned threads = 0;
  bool force = false;
};

std::vector<SimulatedRecording> planned(const Options& options) {
  if (options.tracker_noises_mm.empty()) return {{options.out, options.simulation.noise()}};
  std::vector<SimulatedRecording> recordings;
  for (const double noise_mm : options.tracker_noises_mm) {
    std::filesystem::path path = options.out;
    path.replace_filename(
        fmt::format("{}-{}mm{}", options.out.stem().string(), noise_mm, options.out.extension().string()));
    recordings.push_back({path, options.simulation.noise(noise_mm)});
  }
  return recordings;
}

Outcome simulate(const Options& options) {
  const auto begin = std::chrono::steady_clock::now();
  const auto settings = options.simulation.settings();
  if (!settings) return refuse(settings.error(), ExitCode::kWrongUsage);
  const std::vector<SimulatedRecording> recordings = planned(options);
  for (const SimulatedRecording& recording : recordings) {
    if (!options.force && std::filesystem::exists(recording.path)) {
      return refuse(recording.path.string() + ": the file exists; --force overwrites it", ExitCode::kWrongUsage);
    }
  }
  const unsigned threads = options.threads > 0 ? options.threads : std::max(1U, std::thread::hardware_concurrency());

  // Before the rendering threads begin.
  auto stop = StopSignal::install();
  if (!stop) return refuse(stop.error());
  const auto simulation = Simulation::create(*settings, threaded_for(threads));
  if (!simulation) return refuse(simulation.error(), ExitCode::kWrongUsage);
  {
    Progress progress("frames", simulation->frames().size());
    const auto written = write_simulation(*simulation, recordings, threads, [&](std::uint64_t frames) {
      progress.update(frames);
      return !stop->requested();
    });
    if (!written) return refuse(written.error());
    if (!*written) return refuse("stopped by a signal; nothing was written");
  }
  const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  for (const SimulatedRecording& recording : recordings) {
    std::error_code ignored;
    const auto bytes = std::filesystem::file_size(recording.path, ignored);
    fmt::print("{}: {} frames, {:.0f} MB, tracker noise {} mm, in {:.0f} s\n", recording.path.string(),
               simulation->frames().size(), static_cast<double>(bytes) / 1e6, recording.noise.position_rms_mm,
               elapsed_s);
  }
  return {};
}

}  // namespace

void add_simulate_command(Commands& commands) {
  const auto options = std::make_shared<Options>();
  Command& command = commands.add(
      "simulate", "Write a recording of a beating heart with its ground truth: real motion, real ECG, rendered images",
      [options](const Console&) { return simulate(*options); });
  command.add_option("OUT", options->out, "The recording to write (.mcap)")->required();
  Option* noise = options->simulation.add_to(command);
  command
      .add_option("--tracker-noises", options->tracker_noises_mm,
                  "Several position noises, mm, from one rendering: OUT-0mm.mcap, OUT-1.4mm.mcap for 0,1.4")
      ->delimiter(',')
      ->check(Range(0.0, 100.0))
      ->excludes(noise);
  command.add_option("--threads", options->threads, "Rendering threads; the result is the same [all processors]")
      ->check(Range(1U, 256U));
  command.add_flag("--force", options->force, "Overwrite OUT");
}

}  // namespace perimap

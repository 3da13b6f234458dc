// `perimap simulate`: a recording of a beating heart, or of a bench, with its ground truth.
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/command_line/outputs.hpp"
#include "daemon/command_line/progress.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/standins/options/bench_options.hpp"
#include "daemon/standins/options/heart_settings.hpp"
#include "daemon/standins/options/preoperative_options.hpp"
#include "daemon/standins/options/scope_options.hpp"
#include "daemon/standins/options/simulation_options.hpp"
#include "drivers/standins/procedure/procedure_text.hpp"
#include "drivers/standins/session/bench_writer.hpp"
#include "drivers/standins/session/session_writer.hpp"
#include "drivers/standins/simulator/frame_renderer.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

// What the command line gave.
struct SimulateOptions {
  std::filesystem::path out;
  SimulationOptions simulation;
  ScopeOptions scope;
  BenchOptions bench;
  PreoperativeOptions preoperative;
  std::vector<double> tracker_noises_mm;
  unsigned threads = 0;
  bool force = false;
  std::filesystem::path procedure;  // to write the one that is simulated to
  bool tool = false;                // a tracked probe touches the heart
  std::filesystem::path untold;     // a second recording of the same, without its set-up; empty: none

  [[nodiscard]] unsigned thread_count() const { return rendering_threads(threads); }
};

class Stopwatch {
 public:
  [[nodiscard]] double elapsed_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

Expected<void> check_new(const std::vector<std::filesystem::path>& paths, const SimulateOptions& options) {
  for (const std::filesystem::path& path : paths) {
    if (!path.empty() && !options.force && std::filesystem::exists(path)) {
      return fail(path.string() + ": the file exists; --force overwrites it");
    }
  }
  return {};
}

Expected<BenchScene> bench_scene(const SimulateOptions& options) {
  auto settings = options.simulation.bench(*options.bench.act());
  if (!settings) return tl::unexpected(settings.error());
  auto board = options.bench.board();
  if (!board) return tl::unexpected(board.error());
  settings->board = *std::move(board);
  settings->board_is_held = options.bench.board_is_held();
  options.scope.apply(*settings);
  return BenchScene::create(*settings);
}

Outcome simulate_bench(const SimulateOptions& options, const Console& console) {
  const Stopwatch watch;
  const std::filesystem::path &truth = options.bench.truth(), &landmarks = options.bench.landmarks();
  const auto scene = bench_scene(options);
  if (!scene) return refuse(scene.error(), ExitCode::kWrongUsage);
  for (const auto& sound :
       {check_apart({{"OUT", options.out.string()}, {"--truth", truth.string()}, {"--landmarks", landmarks.string()}},
                    {}),
        check_new({options.out, truth, landmarks}, options)}) {
    if (!sound) return refuse(sound.error(), ExitCode::kWrongUsage);
  }
  const TrackerNoise noise = options.simulation.noise();
  {
    Progress progress(console, "frames", scene->frames().size());
    const auto written = write_bench(*scene, options.out, noise, options.thread_count(),
                                     [&](std::uint64_t frames) { progress.update(frames); });
    if (!written) return refuse(written.error());
  }
  for (const auto& [path, text] :
       {std::pair(truth, true_setup_of(*scene, noise)), std::pair(landmarks, landmark_table_of(*scene))}) {
    if (path.empty()) continue;
    if (const auto written = write_text_file(path, text); !written) return refuse(written.error());
  }
  fmt::print("{}: {}, {} frames, {} poses each of scope and pointer, tracker noise {} mm, in {:.0f} s\n",
             options.out.string(), scene->settings().board.name, scene->frames().size(), scene->reading_count(),
             noise.position_rms_mm, watch.elapsed_s());
  return {};
}

std::vector<SimulatedRecording> planned(const SimulateOptions& options) {
  std::vector<SimulatedRecording> recordings;
  if (!options.untold.empty()) recordings.push_back({options.untold, options.simulation.noise(), false});
  if (options.tracker_noises_mm.empty()) recordings.push_back({options.out, options.simulation.noise()});
  for (const double noise_mm : options.tracker_noises_mm) {
    std::filesystem::path path = options.out;
    path.replace_filename(
        fmt::format("{}-{}mm{}", options.out.stem().string(), noise_mm, options.out.extension().string()));
    recordings.push_back({path, options.simulation.noise(noise_mm)});
  }
  for (SimulatedRecording& recording : recordings) recording.tool = options.tool;
  return recordings;
}

// Every file that is written, by the option that names it.
std::vector<Output> outputs_of(const SimulateOptions& options, const std::vector<SimulatedRecording>& recordings) {
  std::vector<Output> outputs{{"--write-procedure", options.procedure.string()}};
  if (options.preoperative.wanted()) {
    for (const auto& file : options.preoperative.files()) outputs.push_back({"--preoperative", file.string()});
  }
  for (const SimulatedRecording& recording : recordings) {
    const bool untold = !options.untold.empty() && &recording == &recordings.front();
    const std::string of_noise = options.tracker_noises_mm.empty()
                                     ? "OUT"
                                     : fmt::format("OUT with a noise of {} mm", recording.noise.position_rms_mm);
    outputs.push_back({untold ? "--untold" : of_noise, recording.path.string()});
  }
  return outputs;
}

Outcome simulate_heart(const SimulateOptions& options, const Console& console) {
  const Stopwatch watch;
  const auto settings = heart_settings(options.simulation, options.scope);
  if (!settings) return refuse(settings.error(), ExitCode::kWrongUsage);
  const std::vector<SimulatedRecording> recordings = planned(options);
  if (const auto apart = check_apart(outputs_of(options, recordings), {}); !apart) {
    return refuse(apart.error(), ExitCode::kWrongUsage);
  }
  for (const SimulatedRecording& recording : recordings) {
    if (const auto sound = check_new({recording.path, options.procedure}, options); !sound) {
      return refuse(sound.error(), ExitCode::kWrongUsage);
    }
  }
  if (options.preoperative.wanted()) {
    if (const auto sound = check_new(options.preoperative.files(), options); !sound) {
      return refuse(sound.error(), ExitCode::kWrongUsage);
    }
  }
  if (!options.procedure.empty()) {
    const auto written = write_text_file(options.procedure, to_toml(settings->procedure));
    if (!written) return refuse(written.error());
  }
  const unsigned threads = options.thread_count();

  // Before the rendering threads begin.
  auto stop = StopSignal::install();
  if (!stop) return refuse(stop.error());
  const auto simulation = Simulation::create(*settings, threaded_for(threads));
  if (!simulation) return refuse(simulation.error(), ExitCode::kWrongUsage);
  if (options.preoperative.wanted()) {
    if (const auto written = options.preoperative.write(*simulation); !written) return refuse(written.error());
  }
  {
    Progress progress(console, "frames", simulation->frames().size());
    const auto written = write_simulation(*simulation, recordings, threads, [&](std::uint64_t frames) {
      progress.update(frames);
      return !stop->requested();
    });
    if (!written) return refuse(written.error());
    if (!*written) return refuse("stopped by a signal; nothing was written");
  }
  for (const SimulatedRecording& recording : recordings) {
    std::error_code ignored;
    const auto bytes = std::filesystem::file_size(recording.path, ignored);
    fmt::print("{}: {} frames, {:.0f} MB, tracker noise {} mm, in {:.0f} s\n", recording.path.string(),
               simulation->frames().size(), static_cast<double>(bytes) / 1e6, recording.noise.position_rms_mm,
               watch.elapsed_s());
  }
  return {};
}

// That the options go together.
Expected<void> check(const SimulateOptions& options) {
  const bool of_bench = options.bench.act().has_value();
  if (auto sound = options.bench.check(); !sound) return sound;
  if (auto sound = options.scope.check(options.bench.act()); !sound) return sound;
  if (of_bench && options.simulation.has_procedure()) return fail("--procedure: expected --scene heart");
  if (auto sound = options.preoperative.check(); !sound) return sound;
  if (options.preoperative.wanted() && (of_bench || options.simulation.has_procedure())) {
    return fail("--preoperative: expected --scene heart, and no --procedure, which moves the heart elsewhere");
  }
  if (of_bench && !options.untold.empty()) {
    return fail("--untold: expected --scene heart; a bench's recording never tells its set-up");
  }
  if (!options.procedure.empty() && !options.simulation.has_procedure()) {
    return fail("--write-procedure: expected --procedure, whose script it writes");
  }
  if (of_bench && options.tool) return fail("--tool: expected --scene heart; a bench has a pointer of its own");
  if (of_bench && !options.tracker_noises_mm.empty()) {
    return fail("--tracker-noises: expected --scene heart; a bench has one, --tracker-noise");
  }
  return {};
}

Outcome simulate(const SimulateOptions& options, const Console& console) {
  if (const auto sound = check(options); !sound) return refuse(sound.error(), ExitCode::kWrongUsage);
  return options.bench.act() ? simulate_bench(options, console) : simulate_heart(options, console);
}

}  // namespace

void add_simulate_command(Commands& commands) {
  const auto options = std::make_shared<SimulateOptions>();
  Command& command = commands.add("simulate",
                                  "Write a recording of a beating heart with its ground truth: real motion, real ECG, "
                                  "rendered images; or of a bench "
                                  "on which a set-up is measured",
                                  [options](const Console& console) { return simulate(*options, console); });
  command.add_option("OUT", options->out, "The recording to write (.mcap)")->required();
  Option* noise = options->simulation.add_to(command);
  options->simulation.add_procedure_to(command);
  options->bench.add_to(command);
  options->scope.add_to(command);
  options->preoperative.add_to(command);
  command.add_option("--write-procedure", options->procedure,
                     "With --procedure: write its script to this file, as when it was drawn");
  command.add_option(
      "--untold", options->untold,
      "Of a heart: write a second recording of the same, without the set-up that OUT has attached (lens, "
      "hand-eye, clocks, noise), as what devices give that nobody has measured");
  command.add_flag("--tool", options->tool,
                   "Of a heart: a tracked probe touches it now and then; its true distance from the surface, and its "
                   "tip, are in the recording");
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

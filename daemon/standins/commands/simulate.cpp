// `perimap simulate`: a recording of a beating heart with its ground truth.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "core/angle/angle.hpp"
#include "daemon/command_line/commands.hpp"
#include "daemon/command_line/outputs.hpp"
#include "daemon/command_line/progress.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/standins/commands/simulation_options.hpp"
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
  std::vector<double> tracker_noises_mm;
  unsigned threads = 0;
  bool force = false;
  std::optional<BenchAct> act;  // none: the heart
  std::string board = "charuco";
  std::optional<double> notch_deg;
  double zoom = 1.0;
  std::vector<double> turn_to_deg, turn_at_s;
  std::vector<double> zoom_to, zoom_at_s;
  bool scope_uncalibrated = false;
  bool second_sensor = false;
  std::filesystem::path truth;
  std::filesystem::path landmarks;
  std::filesystem::path procedure;  // to write the one that is simulated to

  [[nodiscard]] unsigned thread_count() const {
    return threads > 0 ? threads : std::max(1U, std::thread::hardware_concurrency());
  }
};

// A4 paper takes either; a scope at 15 cm sees most of it.
Expected<BoardPattern> board_of(const SimulateOptions& options) {
  constexpr int kDictionary4x4_100 = 1;
  return options.board == "chessboard" ? chessboard_pattern(9, 6, 8.0)
                                       : charuco_pattern(12, 9, 8.0, 6.0, kDictionary4x4_100);
}

Outcome check_new(const std::filesystem::path& path, const SimulateOptions& options) {
  if (options.force || !std::filesystem::exists(path)) return {};
  return refuse(path.string() + ": the file exists; --force overwrites it", ExitCode::kWrongUsage);
}

// How a scope that is swung about a board is turned and zoomed meanwhile, in the order of the times.
std::vector<BenchSettings::Turn> bench_turns(const SimulateOptions& options) {
  struct Change {
    double at_s;
    std::optional<double> turn_to_deg;
    std::optional<double> zoom_to;
  };
  std::vector<Change> changes;
  for (std::size_t i = 0; i < options.turn_to_deg.size(); ++i) {
    changes.push_back({options.turn_at_s.at(i), options.turn_to_deg[i], std::nullopt});
  }
  for (std::size_t i = 0; i < options.zoom_to.size(); ++i) {
    changes.push_back({options.zoom_at_s.at(i), std::nullopt, options.zoom_to[i]});
  }
  std::stable_sort(changes.begin(), changes.end(), [](const Change& a, const Change& b) { return a.at_s < b.at_s; });
  std::vector<BenchSettings::Turn> turns;
  ScopeHeld held{options.notch_deg.value_or(0.0) * kDegree, options.zoom};
  for (const Change& change : changes) {
    if (change.turn_to_deg) held.notch_rad = *change.turn_to_deg * kDegree;
    held.zoom = change.zoom_to.value_or(held.zoom);
    turns.push_back({from_seconds(change.at_s), held});
  }
  return turns;
}

Outcome simulate_bench(const SimulateOptions& options, const Console& console) {
  const auto begin = std::chrono::steady_clock::now();
  auto settings = options.simulation.bench(*options.act);
  if (!settings) return refuse(settings.error(), ExitCode::kWrongUsage);
  auto board = board_of(options);
  if (!board) return refuse(board.error(), ExitCode::kWrongUsage);
  settings->board = *std::move(board);
  if (options.notch_deg) settings->notch_rad = *options.notch_deg * kDegree;
  settings->zoom = options.zoom;
  settings->second_sensor = options.second_sensor;
  settings->turns = bench_turns(options);
  const auto scene = BenchScene::create(*settings);
  if (!scene) return refuse(scene.error(), ExitCode::kWrongUsage);
  if (const auto apart = check_apart({{"OUT", options.out.string()},
                                      {"--truth", options.truth.string()},
                                      {"--landmarks", options.landmarks.string()}},
                                     {});
      !apart) {
    return refuse(apart.error(), ExitCode::kWrongUsage);
  }
  for (const std::filesystem::path& path : {options.out, options.truth, options.landmarks}) {
    if (path.empty()) continue;
    if (auto is_new = check_new(path, options); !is_new) return is_new;
  }
  const TrackerNoise noise = options.simulation.noise();
  {
    Progress progress(console, "frames", scene->frames().size());
    const auto written = write_bench(*scene, options.out, noise, options.thread_count(),
                                     [&](std::uint64_t frames) { progress.update(frames); });
    if (!written) return refuse(written.error());
  }
  for (const auto& [path, text] : {std::pair(options.truth, true_setup_of(*scene, noise)),
                                   std::pair(options.landmarks, landmark_table_of(*scene))}) {
    if (path.empty()) continue;
    if (const auto written = write_text_file(path, text); !written) return refuse(written.error());
  }
  const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  fmt::print("{}: {}, {} frames, {} poses each of scope and pointer, tracker noise {} mm, in {:.0f} s\n",
             options.out.string(), scene->settings().board.name, scene->frames().size(), scene->reading_count(),
             noise.position_rms_mm, elapsed_s);
  return {};
}

std::vector<SimulatedRecording> planned(const SimulateOptions& options) {
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

Outcome check_turns(const SimulateOptions& options) {
  const std::size_t turns = options.turn_to_deg.size(), zooms = options.zoom_to.size();
  const auto wrong = [](const char* what) { return refuse(what, ExitCode::kWrongUsage); };
  if (turns + zooms > 0 && !options.notch_deg) {
    return wrong("--turn-to, --zoom-to: expected --field-stop, where the notch is before");
  }
  if (options.act && options.act != BenchAct::kBoard && turns + zooms > 0) {
    return wrong("--turn-to, --zoom-to: expected --scene heart or board");
  }
  if (!options.act && (turns > 1 || zooms > 1)) {
    return wrong("--turn-to, --zoom-to: before a heart the scope is turned and zoomed once");
  }
  const bool turned_as_often = options.act ? options.turn_at_s.size() == turns : options.turn_at_s.size() <= 1;
  if (!turned_as_often) return wrong("--turn-at: expected one of each --turn-to, when it begins");
  if (options.zoom_at_s.size() != (options.act ? zooms : 0)) {
    return wrong("--zoom-at: expected --scene board, and one of each --zoom-to, when it begins");
  }
  return {};
}

Outcome simulate(const SimulateOptions& options, const Console& console) {
  const bool of_bench = !options.truth.empty() || !options.landmarks.empty();
  if (!options.act && of_bench) {
    return refuse("--truth, --landmarks: expected --scene board, still or landmarks", ExitCode::kWrongUsage);
  }
  if (const auto sound = check_turns(options); !sound) return sound;
  if (options.zoom != 1.0 && !options.notch_deg) {
    return refuse("--zoom: expected --field-stop, which tells of it", ExitCode::kWrongUsage);
  }
  if (options.second_sensor && !options.notch_deg) {
    return refuse("--second-sensor: expected --field-stop, how the scope is turned", ExitCode::kWrongUsage);
  }
  if (options.second_sensor && !options.zoom_to.empty()) {
    return refuse("--second-sensor: expected no --zoom-to, of which it does not tell", ExitCode::kWrongUsage);
  }
  if (options.act && options.simulation.has_procedure()) {
    return refuse("--procedure: expected --scene heart", ExitCode::kWrongUsage);
  }
  if (!options.procedure.empty() && !options.simulation.has_procedure()) {
    return refuse("--write-procedure: expected --procedure, whose script it writes", ExitCode::kWrongUsage);
  }
  if (options.act && !options.tracker_noises_mm.empty()) {
    return refuse("--tracker-noises: expected --scene heart; a bench has one, --tracker-noise", ExitCode::kWrongUsage);
  }
  if (options.act) return simulate_bench(options, console);
  const auto begin = std::chrono::steady_clock::now();
  auto settings = options.simulation.settings();
  if (!settings) return refuse(settings.error(), ExitCode::kWrongUsage);
  if (options.notch_deg) settings->held = ScopeHeld{*options.notch_deg * kDegree, options.zoom};
  settings->scope_calibrated = !options.scope_uncalibrated;
  settings->second_sensor = options.second_sensor;
  if (!options.turn_to_deg.empty() || !options.zoom_to.empty()) {
    constexpr double kUsualTurn_s = 10.0;
    const double to_deg = options.turn_to_deg.empty() ? *options.notch_deg : options.turn_to_deg.front();
    const ScopeHeld to{to_deg * kDegree, options.zoom_to.empty() ? options.zoom : options.zoom_to.front()};
    const double at_s = options.turn_at_s.empty() ? kUsualTurn_s : options.turn_at_s.front();
    settings->turn = SimulationSettings::Turn{from_seconds(at_s), to};
  }
  if (options.simulation.has_procedure()) {
    auto procedure = options.simulation.procedure(*settings);
    if (!procedure) return refuse(procedure.error(), ExitCode::kWrongUsage);
    settings->procedure = *std::move(procedure);
  }
  const std::vector<SimulatedRecording> recordings = planned(options);
  for (const SimulatedRecording& recording : recordings) {
    if (auto is_new = check_new(recording.path, options); !is_new) return is_new;
  }
  if (!options.procedure.empty()) {
    if (auto is_new = check_new(options.procedure, options); !is_new) return is_new;
    for (const SimulatedRecording& recording : recordings) {
      if (const auto apart =
              check_apart({{"OUT", recording.path.string()}, {"--write-procedure", options.procedure.string()}}, {});
          !apart) {
        return refuse(apart.error(), ExitCode::kWrongUsage);
      }
    }
    if (const auto written = write_text_file(options.procedure, to_toml(settings->procedure)); !written) {
      return refuse(written.error());
    }
  }
  const unsigned threads = options.thread_count();

  // Before the rendering threads begin.
  auto stop = StopSignal::install();
  if (!stop) return refuse(stop.error());
  const auto simulation = Simulation::create(*settings, threaded_for(threads));
  if (!simulation) return refuse(simulation.error(), ExitCode::kWrongUsage);
  {
    Progress progress(console, "frames", simulation->frames().size());
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
  const auto options = std::make_shared<SimulateOptions>();
  Command& command = commands.add("simulate",
                                  "Write a recording of a beating heart with its ground truth: real motion, real ECG, "
                                  "rendered images; or of a bench "
                                  "on which a set-up is measured",
                                  [options](const Console& console) { return simulate(*options, console); });
  command.add_option("OUT", options->out, "The recording to write (.mcap)")->required();
  Option* noise = options->simulation.add_to(command);
  options->simulation.add_procedure_to(command);
  command
      .add_option_function<std::string>(
          "--scene",
          [options](const std::string& name) {
            const std::map<std::string, BenchAct> acts{
                {"board", BenchAct::kBoard}, {"still", BenchAct::kStill}, {"landmarks", BenchAct::kLandmarks}};
            const auto act = acts.find(name);
            options->act = act == acts.end() ? std::nullopt : std::optional(act->second);
          },
          "heart; or what calibrations are made from: board (the scope is swung about a board, a pointer about the "
          "board's origin), still (both lie still), landmarks (six of a patient's are touched) [heart]")
      ->check(OneOf({"heart", "board", "still", "landmarks"}));
  command.add_option("--board", options->board, "The board of such a scene: squares of 8 mm, 10x7 or 12x9 of them")
      ->check(OneOf({"chessboard", "charuco"}))
      ->capture_default_str();
  command
      .add_option("--field-stop", options->notch_deg,
                  "An angled scope whose field stop leaves a round of the picture: its notch is so many degrees from "
                  "the right towards below, and hand-eye and principal point are as the scope is turned then [none]")
      ->check(Range(-360.0, 360.0));
  command
      .add_option("--turn-to", options->turn_to_deg,
                  "The scope is turned in its camera head meanwhile, until its notch is there; of a board also several "
                  "times, each within two seconds")
      ->one_at_a_time()
      ->check(Range(-360.0, 360.0));
  command.add_option("--zoom", options->zoom, "With --field-stop: so many times larger are picture and field stop")
      ->check(Range(0.5, 2.0))
      ->capture_default_str();
  command.add_flag("--second-sensor", options->second_sensor,
                   "With --field-stop: a second tracked sensor, on the scope, tells how that is turned; the field stop "
                   "lies outside the picture then");
  command.add_flag("--scope-uncalibrated", options->scope_uncalibrated,
                   "Of a heart with --field-stop: the recording has hand-eye and lens of its start alone, and not what "
                   "follows when the scope is turned");
  command
      .add_option("--zoom-to", options->zoom_to,
                  "The scope is zoomed to that meanwhile; of a board also several times, each within two seconds")
      ->one_at_a_time()
      ->check(Range(0.5, 2.0));
  command.add_option("--zoom-at", options->zoom_at_s, "Of a board: when each of --zoom-to begins, s")
      ->one_at_a_time()
      ->check(Range(0.0, 1700.0));
  command
      .add_option("--turn-at", options->turn_at_s,
                  "When each of --turn-to begins, s; of a heart, which is turned and zoomed at once, it takes one [10]")
      ->one_at_a_time()
      ->check(Range(0.0, 1700.0));
  command.add_option("--truth", options->truth, "Of such a scene: write to this file what is to be found (JSON)");
  command.add_option("--landmarks", options->landmarks,
                     "Of such a scene: write the landmarks of the patient's image to this file, for perimap register");
  command.add_option("--write-procedure", options->procedure,
                     "With --procedure: write its script to this file, as when it was drawn");
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

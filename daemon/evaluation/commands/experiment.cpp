// `perimap experiment`: the paper's experiments.
#include "daemon/evaluation/experiment/experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/command_line/progress.hpp"
#include "daemon/evaluation/experiment/experiment_files.hpp"
#include "daemon/evaluation/experiment/experiment_text.hpp"
#include "daemon/evaluation/traces/trace_text.hpp"
#include "drivers/json/json_text.hpp"
#include "drivers/standins/trace/motion_trace.hpp"

namespace perimap {
namespace {

struct ExperimentOptions {
  ExperimentSettings settings;
  TraceExperimentSettings of_trace;
  std::filesystem::path trace;
  std::filesystem::path r_peaks;
  std::filesystem::path out;
  bool json = false;
};

Outcome predict_trace(const ExperimentOptions& options, const Console& console) {
  const auto trace = read_motion_trace(options.trace);
  if (!trace) return refuse(trace.error());
  std::vector<double> r_peaks_s;
  if (!options.r_peaks.empty()) {
    auto read = read_r_peaks(options.r_peaks);
    if (!read) return refuse(read.error());
    r_peaks_s = std::move(*read);
  }
  Expected<TraceExperiment> experiment = tl::unexpected(Error{});
  {
    const int starts = std::max(options.of_trace.to - options.of_trace.from + 1, 1);
    Progress progress(console, "starts", static_cast<std::uint64_t>(starts));
    experiment = run_trace_experiment(options.of_trace, *trace, r_peaks_s,
                                      [&](int done) { progress.update(static_cast<std::uint64_t>(done)); });
  }
  if (!experiment) return refuse(experiment.error());
  if (!options.out.empty()) {
    if (const auto written = write_files(*experiment, options.out); !written) return refuse(written.error());
  }
  fmt::print("{}", options.json ? json_document(to_json(*experiment)) : to_table(*experiment));
  return {};
}

// What is wrong with the options; empty when nothing is.
std::string misuse(const ExperimentOptions& options) {
  if (options.settings.number != 3) return {};
  if (options.trace.empty()) return "experiment 3: needs a motion trace: --trace FILE";
  if (options.of_trace.to < options.of_trace.from) return "--to: before --from: there is nothing to predict from";
  return {};
}

Outcome repeat(const ExperimentOptions& options, const Console& console) {
  if (const std::string wrong = misuse(options); !wrong.empty()) return refuse(wrong, ExitCode::kWrongUsage);
  if (!options.out.empty()) {
    if (const auto able = prepare_experiment_files(options.settings.number, options.out); !able)
      return refuse(able.error());
  }
  if (options.settings.number == 3) return predict_trace(options, console);
  Expected<Experiment> experiment = tl::unexpected(Error{});
  {
    Progress progress(console, "trials", static_cast<std::uint64_t>(options.settings.trials));
    experiment =
        run_experiment(options.settings, [&](int trials) { progress.update(static_cast<std::uint64_t>(trials)); });
  }
  if (!experiment) return refuse(experiment.error());
  if (!options.out.empty()) {
    if (const auto written = write_files(*experiment, options.out); !written) return refuse(written.error());
  }
  fmt::print("{}", options.json ? json_document(to_json(*experiment)) : to_table(*experiment));
  return {};
}

}  // namespace

void add_experiment_command(Commands& commands) {
  const auto options = std::make_shared<ExperimentOptions>();
  Command& command = commands.add("experiment",
                                  "Repeat an experiment of the paper: static EKF, EKF on the Fourier state, the "
                                  "paper's filter, ours, batch MAP and the Cramer-Rao bound on simulated trials",
                                  [options](const Console& console) { return repeat(*options, console); });
  command
      .add_option(
          "NUMBER", options->settings.number,
          "1: surface of a real heart, bearings; 2: laparoscope, 8 features, pixels, tracker noise; 3: recorded "
          "motion of a real heart (--trace), predicted")
      ->required()
      ->check(Range(1, 3));
  command.add_option("--out", options->out,
                     "Folder for the table (CSV, JSON), the figures (PNG, SVG, CSV) and one HTML page; made if needed");
  command.add_option("--seed", options->settings.seed, "Chooses features, path, rhythm and noise")
      ->check(Range(std::uint64_t{0}, std::uint64_t{1'000'000'000}))
      ->capture_default_str();
  command.add_option("--trials", options->settings.trials, "How many trials of 5 (1) or 8 (2) features")
      ->check(Range(1, 100'000))
      ->capture_default_str();
  command
      .add_option("--step-factor", options->settings.methods.paper_step,
                  "Gamma of the paper's update: the share of each Gauss-Newton step that is taken")
      ->check(Range(0.01, 1.0))
      ->capture_default_str();
  command.add_option("--iterations", options->settings.methods.paper_iterations, "Iterations of the paper's update")
      ->check(Range(1, 1000))
      ->capture_default_str();
  command.add_option("--trace", options->trace,
                     "Experiment 3: recorded motion, a CSV with a time in seconds and x, y, z in mm of each point");
  command.add_option("--r-peaks", options->r_peaks,
                     "Experiment 3: times of R peaks in seconds, one a line; each is used 0.1 s after it");
  command.add_option("--from", options->of_trace.from, "Experiment 3: first sample that is predicted from")
      ->check(Range(0, 100'000'000))
      ->capture_default_str();
  command.add_option("--to", options->of_trace.to, "Experiment 3: the last one")
      ->check(Range(0, 100'000'000))
      ->capture_default_str();
  command.add_flag("--json", options->json, "Print JSON in place of the table");
}

}  // namespace perimap

#include "daemon/evaluation/commands/report.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "daemon/commands/same_file.hpp"
#include "daemon/evaluation/report/accuracy_picture.hpp"
#include "daemon/evaluation/report/accuracy_text.hpp"
#include "daemon/evaluation/report/samples_report.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

struct Options {
  std::string recording;
  std::string samples;
  std::string stream;
  std::string picture;
  std::string json;
  bool whole = false;
};

double milliseconds(Duration d) { return std::chrono::duration<double, std::milli>(d).count(); }

std::string figures_text(const DurationFigures& figures) {
  return fmt::format("{:.2f} / {:.2f} / {:.2f} ms", milliseconds(figures.p50), milliseconds(figures.p99),
                     milliseconds(figures.max));
}

nlohmann::json figures_json(const DurationFigures& figures) {
  return {{"p50_ms", milliseconds(figures.p50)},
          {"p99_ms", milliseconds(figures.p99)},
          {"max_ms", milliseconds(figures.max)}};
}

constexpr int kFailure = 1;
constexpr int kWrongUse = 2;

int refuse(const std::string& message, int code = kFailure) {
  fmt::print(stderr, "perimap report: {}\n", message);
  return code;
}

int report(const Options& options) {
  for (const auto& [name, file] : {std::pair("--json", options.json), std::pair("--picture", options.picture)}) {
    if (is_same_file(file, options.recording) || is_same_file(file, options.samples)) {
      return refuse(fmt::format("{}: is a file that is read", name), kWrongUse);
    }
  }
  const auto result = report_samples(options.recording, options.samples, options.stream,
                                     options.whole ? ReadMode::kWhole : ReadMode::kStrict);
  if (!result) return refuse(result.error().message);
  // In lockstep nothing takes time.
  const bool timed = result->release_to_receipt.max != Duration(0);
  fmt::print("samples     {} received, {} missed, {} without frame, {} from a late update\n", result->samples,
             result->missed, result->without_frame, result->from_late_update);
  if (!timed) {
    fmt::print("latency     not measured: these samples are of a lockstep replay\n");
  } else {
    fmt::print(
        "latency     capture to receipt p50 / p99 / max {}\n"
        "release     receipt after its deadline {}, jitter {}\n",
        figures_text(result->capture_to_receipt), figures_text(result->release_to_receipt),
        figures_text(result->jitter));
  }
  fmt::print("{}\n", to_text(result->accuracy));
  if (!options.picture.empty()) {
    const auto written = write_text_file(options.picture, to_svg(result->accuracy, options.recording));
    if (!written) return refuse(written.error().message);
    fmt::print("picture     {}\n", options.picture);
  }
  if (!options.json.empty()) {
    const auto figures = [timed](const DurationFigures& measured) {
      return timed ? figures_json(measured) : nlohmann::json(nullptr);
    };
    const nlohmann::json json = {{"recording", options.recording},
                                 {"samples",
                                  {{"received", result->samples},
                                   {"missed", result->missed},
                                   {"without_frame", result->without_frame},
                                   {"from_late_update", result->from_late_update}}},
                                 {"capture_to_receipt", figures(result->capture_to_receipt)},
                                 {"release_to_receipt", figures(result->release_to_receipt)},
                                 {"jitter", figures(result->jitter)},
                                 {"accuracy", to_json(result->accuracy)}};
    const auto written = write_text_file(options.json, json.dump(2) + "\n");
    if (!written) return refuse(written.error().message);
  }
  return 0;
}

}  // namespace

void add_report_command(CLI::App& app, int& exit_code) {
  auto* command =
      app.add_subcommand("report", "Compare received samples with the truth of the simulated recording they are of");
  auto options = std::make_shared<Options>();
  command->add_option("RECORDING", options->recording, "The simulated recording (MCAP)")->required();
  command->add_option("--samples", options->samples, "What was received (perimap watch --record, replay --samples)")
      ->required();
  command->add_option("--stream", options->stream, "The stream to report on, where there are several: frame or clock");
  command->add_option("--picture", options->picture, "Write motion paths and error over time to this SVG file");
  command->add_option("--json", options->json, "Write the report as JSON to this file");
  command->add_flag("--whole", options->whole, "Use what is whole of damaged files");
  command->callback([options, &exit_code] { exit_code = report(*options); });
}

}  // namespace perimap

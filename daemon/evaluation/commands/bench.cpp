// `perimap bench`: latencies, measured with subscribers in other processes.
#include "daemon/evaluation/bench/bench.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/command_line/outputs.hpp"
#include "daemon/evaluation/bench/bench_keys.hpp"
#include "daemon/evaluation/bench/bench_text.hpp"
#include "daemon/evaluation/bench/own_network.hpp"
#include "daemon/evaluation/bench/scratch_folder.hpp"
#include "daemon/evaluation/bench/subscriber.hpp"
#include "daemon/evaluation/bench/trace_file.hpp"
#include "daemon/logging/logging.hpp"
#include "daemon/process/stop_signal.hpp"
#include "drivers/json/json_text.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr int kDomain = 99;

struct BenchOptions {
  bench::BenchSettings settings;
  std::string configuration;
  std::vector<std::string> only;
  std::string scratch;
  bool security = false;
  double seconds = 10.0;
  double settle = 8.0;
  std::string json;
  std::string html;
  std::string trace;
};

Outcome measure(const BenchOptions& options, const Console& console) {
  const std::string& recording = options.settings.input.recording;
  const std::initializer_list<Output> outputs = {
      {"--json", options.json}, {"--html", options.html}, {"--trace", options.trace}};
  if (auto apart = check_apart(outputs, {{"the recording itself", recording}}); !apart)
    return refuse(apart.error(), ExitCode::kWrongUsage);
  if (auto able = check_writable(outputs); !able) return refuse(able.error());
  auto stop = StopSignal::install();
  if (!stop) return refuse(stop.error());
  const auto scratch = bench::ScratchFolder::create(options.scratch.empty() ? std::filesystem::temp_directory_path()
                                                                            : std::filesystem::path(options.scratch));
  if (!scratch) return refuse(scratch.error());
  bench::keep_to_ourselves();
  const Logging logging(console.name(), LogConfiguration::Level::kError);

  bench::BenchSettings settings = options.settings;
  settings.parts = bench::chosen_parts(options.only, options.security);
  if (!options.configuration.empty()) settings.input.configuration = options.configuration;
  settings.input.domain = kDomain;
  settings.input.settle = from_seconds(options.settle);
  settings.input.measure = from_seconds(options.seconds);
  settings.input.scratch = scratch->path();
  if (options.security) {
    if (const auto made = bench::make_keys(settings.input); !made) return refuse(made.error());
  }
  std::optional<bench::TraceFile> trace;
  if (!options.trace.empty()) {
    auto created = bench::TraceFile::create(options.trace);
    if (!created) return refuse(created.error());
    trace.emplace(std::move(*created));
  }
  const auto report = bench::run_bench(
      settings, *stop,
      [&](int number, int all, const std::string& name) {
        console.complain(fmt::format("{:3}/{} {}", number, all, name));
      },
      trace ? &*trace : nullptr);
  if (!report) return refuse(report.error());
  if (trace) {
    if (auto done = trace->finish(); !done) return refuse(done.error());
    if (trace->left_out() > 0)
      console.complain(fmt::format("the trace had no room for {} entries, the last of their runs", trace->left_out()));
  }
  if (!options.json.empty()) {
    if (auto done = write_text_file(options.json, json_document(to_json(*report))); !done) return refuse(done.error());
  }
  if (!options.html.empty()) {
    if (auto done = write_text_file(options.html, to_html(*report)); !done) return refuse(done.error());
  }
  fmt::print("{}", to_table(*report));
  return {};
}

void add_subscriber_command(Commands& commands) {
  struct SubscriberOptions {
    int domain = 0;
    std::string stream = "frame";
    int pause_ms = 0;
    std::optional<std::string> security;
  };
  const auto options = std::make_shared<SubscriberOptions>();
  Command& command = commands.add(
      bench::kSubscriberCommand, "What perimap bench runs in another process", [options](const Console&) -> Outcome {
        const auto done = bench::subscribe_until_input_ends({options->domain, options->security}, options->stream,
                                                            std::chrono::milliseconds(options->pause_ms));
        if (!done) return refuse(done.error());
        return {};
      });
  command.group("");
  command.add_option("--domain", options->domain)->check(Range(0, 230));
  command.add_option("--stream", options->stream);
  command.add_option("--security", options->security);
  command.add_option("--pause-ms", options->pause_ms)->check(Range(0, 10'000));
}

}  // namespace

void add_bench_command(Commands& commands) {
  const auto options = std::make_shared<BenchOptions>();
  Command& command = commands.add(
      "bench",
      "Measure latencies by replaying a recording through the whole runtime, with subscribers in other processes",
      [options](const Console& console) { return measure(*options, console); });
  bench::BenchSettings& settings = options->settings;
  command.add_option("RECORDING", settings.input.recording, "The recording (MCAP)")->required();
  command.add_option("-c,--config", options->configuration,
                     "Configuration file; without it the recording's own configuration over the defaults");
  command.add_option("--json", options->json, "Write the figures as JSON to this file");
  command.add_option("--html", options->html, "Write one self-contained page to this file");
  command.add_option("--trace", options->trace,
                     "Write to this file when each part of each frame's life happened, on which thread, in the parts "
                     "that run live; JSON that Perfetto (ui.perfetto.dev) and chrome://tracing open");
  command.add_option("--only", options->only, "These parts alone; ddsperf runs after each run of 'live'")
      ->check(OneOf(bench::kParts))
      ->delimiter(',');
  command.add_flag(
      "--security", options->security,
      "What DDS Security costs: runs with keys and without in turn, and no other parts but those of --only");
  command.add_option("--seconds", options->seconds, "Measured a run")->check(Range(0.5, 1e6))->capture_default_str();
  command.add_option("--settle", options->settle, "Played before, for the map to grow; not measured")
      ->check(Range(0.0, 1e6))
      ->capture_default_str();
  command
      .add_option("--runs", settings.runs, "How often the parts 'live' and 'pages', and those of --security, are run")
      ->check(Range(1, 1000))
      ->capture_default_str();
  command.add_option("--frames", settings.frames, "Frames of the part 'memory'")
      ->check(Range(std::uint64_t{1}, std::uint64_t{1} << 40))
      ->capture_default_str();
  command.add_option("--features", settings.features, "Features at a time")
      ->check(Range(1, 5000))
      ->capture_default_str();
  command.add_option("--workers", settings.workers, "Worker threads")->check(Range(1, 64))->capture_default_str();
  command.add_option("--priority", settings.priority, "SCHED_FIFO priority of the runs that have one")
      ->check(Range(3, 98))
      ->capture_default_str();
  command.add_option("--cpus", settings.cpus, "Processors of these runs' real-time threads [any]")
      ->check(Range(0, 1023))
      ->delimiter(',');
  command.add_option("--scratch", options->scratch, "Where recordings of a run go [the system's temporary folder]");
  add_subscriber_command(commands);
}

}  // namespace perimap

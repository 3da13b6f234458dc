// `perimap replay`: the whole pipeline over a recording.
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>

#include "daemon/command_line/commands.hpp"
#include "daemon/command_line/nested_options.hpp"
#include "daemon/command_line/outputs.hpp"
#include "daemon/command_line/progress.hpp"
#include "daemon/evaluation/replay/replay_run.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/standins/options/unrecorded_options.hpp"
#include "drivers/json/json_text.hpp"
#include "drivers/standins/session/unrecorded_session.hpp"
#include "drivers/standins/simulator/frame_renderer.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

struct ReplayCommandOptions {
  ReplayOptions replay;
  std::optional<std::string> simulated;  // in the recording's place
  std::string configuration;
  std::string json;
  bool whole = false;
};

constexpr const char* kSimulated = "--simulated";

// That there is one thing to replay, in a way in which it can be.
Expected<void> check(const ReplayCommandOptions& options) {
  const bool simulated = options.simulated.has_value();
  if (simulated != options.replay.recording.empty()) return fail("expected either RECORDING or --simulated");
  if (simulated && !options.replay.lockstep) {
    return fail(
        "--simulated: expected --lockstep, since pictures are rendered in the time in which real time would go on");
  }
  if (simulated && options.whole) return fail("--whole: expected RECORDING, of which something may be damaged");
  return {};
}

// Errors of what was asked for are the user's.
tl::expected<UnrecordedSession, Refusal> simulate(const std::string& text) {
  const auto options = parse_unrecorded(kSimulated, text);
  if (!options) return refuse(options.error(), ExitCode::kWrongUsage);
  auto simulation = Simulation::create(options->settings, threaded_for(options->threads));
  if (!simulation) {
    return refuse(told_of_option(kSimulated, simulation.error()), ExitCode::kWrongUsage);
  }
  auto session = UnrecordedSession::create(*std::move(simulation), options->noise, options->threads, options->tool);
  if (!session) return refuse(session.error());
  return *std::move(session);
}

Outcome replay(const ReplayCommandOptions& options, const Console& console) {
  if (const auto sound = check(options); !sound) return refuse(sound.error(), ExitCode::kWrongUsage);
  ReplayOptions wanted = options.replay;
  if (!options.configuration.empty()) wanted.configuration = options.configuration;
  if (options.whole) wanted.mode = ReadMode::kWhole;
  wanted.program = console.name();
  wanted.generator = "perimap replay " PERIMAP_VERSION;
  const Output json{"--json", options.json};
  if (auto apart = check_apart({json, {"--samples", wanted.samples}}, {{"the recording itself", wanted.recording}});
      !apart) {
    return refuse(apart.error(), ExitCode::kWrongUsage);
  }
  if (auto able = check_writable({json}); !able) return refuse(able.error());
  auto stop = StopSignal::install();
  if (!stop) return refuse(stop.error());
  std::optional<UnrecordedSession> session;
  if (options.simulated) {
    auto simulated = simulate(*options.simulated);
    if (!simulated) return tl::unexpected(simulated.error());
    session.emplace(*std::move(simulated));
    wanted.recording = session->recording();
    wanted.simulated = &*session;
  }
  std::optional<Progress> progress;
  const auto report = run_replay(wanted, *stop, [&](std::uint64_t frames, std::uint64_t all) {
    if (!progress) progress.emplace(console, "frames", all);
    progress->update(frames);
  });
  progress.reset();
  if (!report) return refuse(report.error());
  for (const Error& damage : report->damage) console.complain(damage);
  fmt::print("{}", to_text(*report));
  if (options.json.empty()) return {};
  nlohmann::json figures = to_json(*report);
  if (session) {
    figures["simulated"] = *options.simulated;
  } else {
    figures["recording"] = wanted.recording;
  }
  if (auto written = write_text_file(options.json, json_document(figures)); !written) return refuse(written.error());
  return {};
}

}  // namespace

void add_replay_command(Commands& commands) {
  const auto options = std::make_shared<ReplayCommandOptions>();
  Command& command = commands.add("replay", "Run the pipeline over a recording and report accuracy and latencies",
                                  [options](const Console& console) { return replay(*options, console); });
  ReplayOptions& replay = options->replay;
  command.add_option("RECORDING", replay.recording, "The recording (MCAP); or else --simulated");
  command.add_option(kSimulated, options->simulated,
                     "In the place of RECORDING, with --lockstep: options of perimap simulate, in quotes; that session "
                     "is replayed as it is rendered, and no file holds it");
  command.add_option("-c,--config", options->configuration,
                     "Configuration file; without it the recording's own configuration over the defaults");
  command.add_flag("--lockstep", replay.lockstep,
                   "Virtual time, as fast as it goes: the same samples every time (otherwise real time)");
  command.add_option("--workers", replay.workers, "Worker threads (default: the configuration's)")->check(Range(1, 64));
  command.add_option("--json", options->json, "Write the report as JSON to this file");
  command.add_option("--samples", replay.samples, "Write every published sample to this recording (MCAP)");
  command.add_flag("--dds", replay.dds, "Publish over DDS too");
  command.add_flag("--whole", options->whole, "Use what is whole of a damaged recording, and say what is not");
}

}  // namespace perimap

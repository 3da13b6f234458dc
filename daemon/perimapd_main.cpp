// perimapd: reads the sensors, maps the beating surface, publishes it at a fixed latency.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/sensor_entrance.hpp"
#include "daemon/black_box/black_box.hpp"
#include "daemon/black_box/black_box_publication.hpp"
#include "daemon/checkpoint/checkpoint_keeper.hpp"
#include "daemon/command_line/commands.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/configuration_text.hpp"
#include "daemon/config/surface_traffic.hpp"
#include "daemon/config/wrong_key.hpp"
#include "daemon/keys/expiry_news.hpp"
#include "daemon/keys/key_folder.hpp"
#include "daemon/logging/logging.hpp"
#include "daemon/process/reload_signal.hpp"
#include "daemon/process/service_folder.hpp"
#include "daemon/process/service_manager.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/publishing/dds_publication.hpp"
#include "daemon/runtime/configuration_reload.hpp"
#include "daemon/runtime/device_feeder.hpp"
#include "daemon/runtime/device_setup.hpp"
#include "daemon/runtime/last_verification.hpp"
#include "daemon/runtime/live_session.hpp"
#include "daemon/runtime/replay_feeder.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "daemon/runtime/session_recorder.hpp"
#include "daemon/runtime/session_recording.hpp"
#include "drivers/calibration/turned_scope_file.hpp"

namespace perimap {
namespace {

struct Signals {
  StopSignal stop;
  ReloadSignal reload;
};

using black_box::BlackBox;

// Told of lines of the log for as long as this lives.
class LoggedBlackBox {
 public:
  LoggedBlackBox(Logging& logging, black_box::BlackBoxSettings settings)
      : logging_(logging), box_(std::move(settings)) {
    logging_.tell_also([this](std::string_view severity, std::string_view line) { box_.log_line(severity, line); });
  }
  LoggedBlackBox(const LoggedBlackBox&) = delete;
  LoggedBlackBox& operator=(const LoggedBlackBox&) = delete;
  ~LoggedBlackBox() { logging_.tell_also({}); }

  [[nodiscard]] BlackBox& box() noexcept { return box_; }

 private:
  Logging& logging_;
  BlackBox box_;
};

// None where there is no folder for it.
std::unique_ptr<LoggedBlackBox> make_black_box(Logging& logging, const Configuration& configuration,
                                               const PipelineSettings& settings, const Identity& identity) {
  const BlackBoxConfiguration& c = configuration.blackbox;
  const auto folder = c.folder ? c.folder : service_file("STATE_DIRECTORY", "black-box");
  if (!folder) return nullptr;
  const auto bytes = static_cast<std::uint64_t>(c.maximum_MB) * 1'000'000U;
  auto logged = std::make_unique<LoggedBlackBox>(
      logging, black_box::BlackBoxSettings{*folder,
                                           {c.ring, c.keep, bytes},
                                           "perimapd " PERIMAP_VERSION,
                                           identity,
                                           static_cast<std::size_t>(settings.features.maximum)});
  logged->box().configuration(to_toml(configuration));
  return logged;
}

// A session over whatever `make_feeder` gives for the pipeline's entrance. `given`: the file as loaded by itself.
template <class MakeFeeder>
Outcome run_session(const Console& console, const std::string& configuration_file, const Configuration& given,
                    const Configuration& configuration, const PipelineSettings& settings, const Identity& identity,
                    const std::vector<WatchedTool>& tools, Signals& signals, const MakeFeeder& make_feeder) {
  Logging logging(console.name(), configuration.log.level);
  if (!configuration.dds.enabled) {
    return refuse(told_in(configuration_file, {{"dds.enabled", "expected true, since nothing else publishes"}}),
                  ExitCode::kWrongUsage);
  }
  RuntimeSettings runtime = runtime_settings(configuration, identity);
  runtime.tools = tools;
  ExpiryNews expiry;
  if (configuration.dds.security) {
    // With words, before DDS looks at them: it would say no more than that it is not allowed.
    const auto keys = check_keys(*configuration.dds.security, seconds_now());
    if (!keys) {
      return refuse(told_in(configuration_file, {{"dds.security", keys.error().message}}), ExitCode::kWrongUsage);
    }
    runtime.keys_expire_utc_ns = std::chrono::nanoseconds(keys->ends.time_since_epoch()).count();
    spdlog::info("DDS Security: keys of '{}' ({}), until {}", keys->certificate.name, keys->certificate.role,
                 utc_text(keys->ends));
    expiry = ExpiryNews(*keys);
  }
  DdsSettings dds;
  dds.membership = {configuration.dds.domain, configuration.dds.security};
  dds.surface_deadline = configuration.dds.surface_deadline;
  dds.surface_lifespan = configuration.dds.surface_lifespan;
  dds.tools = !tools.empty();
  dds.identity = runtime.identity;
  auto publication = DdsPublication::create(dds);
  if (!publication) return refuse(publication.error());

  Pipeline pipeline(settings);
  ConfigurationReload reload(configuration_file, given);
  const auto logged = make_black_box(logging, configuration, settings, runtime.identity);
  std::optional<black_box::BlackBoxPublication> both;
  if (logged) both.emplace(**publication, logged->box());
  Publication& published = both ? static_cast<Publication&>(*both) : **publication;
  LiveSession session(pipeline, runtime, published, make_feeder(pipeline.entrance()), [&] {
    if (const auto line = expiry.next(seconds_now())) spdlog::warn("{}", *line);
    if (const auto line = logging.next_loss()) spdlog::error("{}", *line);
  });
  if (logged) session.keep_black_box(logged->box());
  ServiceManager service;
  session.report_to(service);
  if (const auto file = configuration.checkpoint.file ? configuration.checkpoint.file
                                                      : service_file("STATE_DIRECTORY", "checkpoint")) {
    session.keep_checkpoints(CheckpointKeeper::go_on_from(*file, configuration, pipeline));
  }
  session.reload_at(signals.reload, std::ref(reload));
  if (const auto socket =
          configuration.control.socket ? configuration.control.socket : service_file("RUNTIME_DIRECTORY", "control")) {
    session.take_commands_at(*socket, std::ref(reload));
  }
  spdlog::info("perimapd {}: publishing '{}' on DDS domain {}, latency {} ms, {} workers", PERIMAP_VERSION,
               configuration.source.name, configuration.dds.domain,
               std::chrono::duration_cast<std::chrono::milliseconds>(configuration.pipeline.latency).count(),
               configuration.pipeline.workers);
  for (const std::string& line : traffic_lines(configuration)) spdlog::info("{}", line);
  const Expected<void> ended = session.run(signals.stop);
  const PipelineCounters& counters = pipeline.counters();
  std::uint64_t surfaces = 0;
  for (const ReleaseStream stream : kReleaseStreams) surfaces += counters.of(stream).samples.get();
  spdlog::info("{}: {} frames, {} surfaces, {} features converged",
               signals.stop.requested() ? "stopped" : "recording ended", counters.frames.get(), surfaces,
               counters.features_converged.get());
  if ((*publication)->failures() > 0) spdlog::error("{} DDS writes failed", (*publication)->failures());
  if (!ended) {
    spdlog::error("{}", ended.error().message);
    return refuse("");  // it stands in the log
  }
  return {};
}

// Guidance does not wait for a disk: without a recording the session goes on, and says so. What was verified of the
// set-up is told here, and goes with each recording.
DeviceRecording prepare_recording(const std::string& configuration_file, const DeviceSetup& setup) {
  const LastVerification last = last_verification(configuration_file, setup.configuration, setup.pipeline.camera);
  if (!last.line.empty()) spdlog::log(last.doubtful ? spdlog::level::warn : spdlog::level::info, "{}", last.line);
  const RecordingConfiguration& c = setup.configuration.recording;
  DeviceRecording recording;
  recording.recorder = std::make_unique<SessionRecorder>(static_cast<std::size_t>(c.memory_MB) << 20U);
  recording.next = [file = std::filesystem::path(configuration_file),
                    folder = std::filesystem::path(configuration_file).parent_path() / c.folder,
                    configuration = setup.configuration, camera = setup.pipeline.camera,
                    scope = setup.pipeline.turned_scope]() -> DeviceRecording::Next {
    SensorRecordingFacts facts = recording_facts(configuration, camera, "perimapd " PERIMAP_VERSION);
    if (scope) facts.turned_scope = format_turned_scope(*scope);
    facts.verification = last_verification(file, configuration, camera).text;
    return {recording_path(folder, std::chrono::system_clock::now()), std::move(facts)};
  };
  if (!c.record) return recording;
  const DeviceRecording::Next next = recording.next();
  if (const auto opened = recording.recorder->open(next.file, next.facts)) {
    spdlog::info("recording to {}", next.file.string());
  } else {
    spdlog::error("not recording: {}; all else goes on", opened.error().message);
  }
  return recording;
}

Outcome run(const std::string& configuration_file, const Console& console) {
  auto stop = StopSignal::install();
  if (!stop) return refuse(stop.error());
  auto reload = ReloadSignal::install();
  if (!reload) return refuse(reload.error());
  Signals signals{*std::move(stop), *std::move(reload)};
  // Whoever read our output has gone away: nothing to stop for. And a file that may not grow is an error like a full
  // disk.
  (void)std::signal(SIGPIPE, SIG_IGN);
  (void)std::signal(SIGXFSZ, SIG_IGN);
  const auto given = load_configuration(configuration_file);
  if (!given) return refuse(given.error(), ExitCode::kWrongUsage);
  if (!given->replay.recording && names_devices(*given)) {
    auto setup = prepare_devices(configuration_file, *given);
    if (!setup) return refuse(setup.error());
    return run_session(console, configuration_file, *given, setup->configuration, setup->pipeline, setup->identity,
                       setup->tools, signals, [&setup, &configuration_file](SensorEntrance& entrance) {
                         return std::make_unique<DeviceFeeder>(std::move(setup->devices), &entrance,
                                                               prepare_recording(configuration_file, *setup));
                       });
  }
  if (!given->replay.recording) {
    return refuse(told_in(configuration_file,
                          {{"replay.recording",
                            "expected the recording to replay, or devices in [camera], [tracker] and [ecg], got "
                            "nothing"}}),
                  ExitCode::kWrongUsage);
  }
  if (given->recording.record) {
    return refuse(told_in(configuration_file,
                          {{"recording.record",
                            "expected false with 'replay.recording', which is a recording already, got true"}}),
                  ExitCode::kWrongUsage);
  }
  auto setup = prepare_replay(given->replay.recording->string(), configuration_file, ReadMode::kStrict);
  if (!setup) return refuse(setup.error());
  return run_session(console, configuration_file, *given, setup->configuration, setup->pipeline, setup->identity,
                     setup->tools, signals, [&setup](SensorEntrance& entrance) {
                       return std::make_unique<ReplayFeeder>(std::move(setup->reader), SensorIntake{&entrance});
                     });
}

int parse_and_run(int argc, char** argv) {
  std::string configuration_file;
  return run_program(
      "perimapd", PERIMAP_VERSION,
      "Maps a beating organ and publishes its predicted surface over DDS at a fixed latency.\n"
      "Research software, not a certified medical device.",
      [&](Command& command) {
        command.add_option("-c,--config", configuration_file, "Configuration file (TOML; see config/replay.toml)")
            ->required();
      },
      [&](const Console& console) { return run(configuration_file, console); }, argc, argv);
}

}  // namespace
}  // namespace perimap

int main(int argc, char** argv) {
  try {
    return perimap::parse_and_run(argc, argv);
  } catch (const std::exception& error) {
    (void)std::fprintf(stderr, "perimapd: %s\n", error.what());
    return 1;
  }
}

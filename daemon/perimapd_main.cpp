// perimapd: reads the sensors, maps the beating surface, publishes it at a fixed latency.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <string>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/sensor_entrance.hpp"
#include "daemon/checkpoint/checkpoint_keeper.hpp"
#include "daemon/config/configuration_difference.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/surface_traffic.hpp"
#include "daemon/logging/logging.hpp"
#include "daemon/process/service_folder.hpp"
#include "daemon/process/service_manager.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/publishing/dds_publication.hpp"
#include "daemon/runtime/device_feeder.hpp"
#include "daemon/runtime/device_setup.hpp"
#include "daemon/runtime/live_session.hpp"
#include "daemon/runtime/replay_feeder.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "daemon/runtime/session_recorder.hpp"
#include "daemon/runtime/session_recording.hpp"

namespace perimap {
namespace {

constexpr int kOk = 0;
constexpr int kFailure = 1;
constexpr int kWrongConfiguration = 2;

int refuse(const Error& error, int code) {
  fmt::print(stderr, "perimapd: {}\n", error.message);
  return code;
}

// Puts into effect what may change while it runs, the log's level; says what needs a restart. `running`: what the
// file came to when it was read last.
Expected<std::string> reload(const std::string& configuration_file, Configuration& running) {
  const auto read = load_configuration(configuration_file);
  if (!read) return tl::unexpected(read.error());
  std::string restart;
  for (const std::string& key : differing_keys(running, *read)) {
    if (key != "log.level") restart += fmt::format("{}{}", restart.empty() ? "" : ", ", key);
  }
  Logging::set_level(read->log.level);
  running.log.level = read->log.level;
  return restart.empty() ? std::string("in effect\n")
                         : fmt::format("in effect but for what needs a restart: {}\n", restart);
}

// A session over whatever `make_feeder` gives for the pipeline's entrance. `given`: the file as loaded by itself.
template <class MakeFeeder>
int run_session(const std::string& configuration_file, const Configuration& given, const Configuration& configuration,
                const PipelineSettings& settings, const Identity& identity, StopSignal& stop,
                const MakeFeeder& make_feeder) {
  const Logging logging(configuration.log.level);
  if (!configuration.dds.enabled) {
    return refuse(
        {fmt::format("{}: key 'dds.enabled': expected true, since nothing else publishes", configuration_file)},
        kWrongConfiguration);
  }
  auto publication = DdsPublication::create(
      {configuration.dds.domain, configuration.dds.surface_deadline, configuration.dds.surface_lifespan});
  if (!publication) return refuse(publication.error(), kFailure);

  Pipeline pipeline(settings);
  const RuntimeSettings runtime = runtime_settings(configuration, identity);
  LiveSession session(pipeline, runtime, **publication, make_feeder(pipeline.entrance()));
  ServiceManager service;
  session.report_to(service);
  if (const auto file = configuration.checkpoint.file ? configuration.checkpoint.file
                                                      : service_file("STATE_DIRECTORY", "checkpoint")) {
    session.keep_checkpoints(CheckpointKeeper::go_on_from(*file, configuration, pipeline));
  }
  Configuration running = given;
  if (const auto socket =
          configuration.control.socket ? configuration.control.socket : service_file("RUNTIME_DIRECTORY", "control")) {
    session.take_commands_at(*socket, [&configuration_file, &running] { return reload(configuration_file, running); });
  }
  spdlog::info("perimapd {}: publishing '{}' on DDS domain {}, latency {} ms, {} workers", PERIMAP_VERSION,
               configuration.source.name, configuration.dds.domain,
               std::chrono::duration_cast<std::chrono::milliseconds>(configuration.pipeline.latency).count(),
               configuration.pipeline.workers);
  for (const std::string& line : traffic_lines(configuration)) spdlog::info("{}", line);
  const Expected<void> ended = session.run(stop);
  const PipelineCounters& counters = pipeline.counters();
  std::uint64_t surfaces = 0;
  for (const ReleaseStream stream : kReleaseStreams) surfaces += counters.of(stream).samples.get();
  spdlog::info("{}: {} frames, {} surfaces, {} features converged", stop.requested() ? "stopped" : "recording ended",
               counters.frames.get(), surfaces, counters.features_converged.get());
  if ((*publication)->failures() > 0) spdlog::error("{} DDS writes failed", (*publication)->failures());
  if (!ended) {
    spdlog::error("{}", ended.error().message);
    return kFailure;
  }
  return kOk;
}

// Guidance does not wait for a disk: without a recording the session goes on, and says so.
DeviceRecording prepare_recording(const std::string& configuration_file, const DeviceSetup& setup) {
  const RecordingConfiguration& c = setup.configuration.recording;
  DeviceRecording recording;
  recording.recorder = std::make_unique<SessionRecorder>(static_cast<std::size_t>(c.memory_MB) << 20U);
  recording.next = [folder = std::filesystem::path(configuration_file).parent_path() / c.folder,
                    configuration = setup.configuration, camera = setup.pipeline.camera]() -> DeviceRecording::Next {
    return {recording_path(folder, std::chrono::system_clock::now()),
            recording_facts(configuration, camera, "perimapd " PERIMAP_VERSION)};
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

int run(const std::string& configuration_file) {
  auto stop = StopSignal::install();
  if (!stop) return refuse(stop.error(), kFailure);
  const auto given = load_configuration(configuration_file);
  if (!given) return refuse(given.error(), kWrongConfiguration);
  if (!given->replay.recording && names_devices(*given)) {
    auto setup = prepare_devices(configuration_file, *given);
    if (!setup) return refuse(setup.error().error, setup.error().configuration ? kWrongConfiguration : kFailure);
    return run_session(configuration_file, *given, setup->configuration, setup->pipeline, setup->identity, *stop,
                       [&setup, &configuration_file](SensorEntrance& entrance) {
                         return std::make_unique<DeviceFeeder>(std::move(setup->devices), &entrance,
                                                               prepare_recording(configuration_file, *setup));
                       });
  }
  if (!given->replay.recording) {
    return refuse({fmt::format("{}: key 'replay.recording': expected the recording to replay, or devices in [camera], "
                               "[tracker] and [ecg], got nothing",
                               configuration_file)},
                  kWrongConfiguration);
  }
  if (given->recording.record) {
    return refuse(
        {fmt::format("{}: key 'recording.record': expected false with 'replay.recording', which is a recording "
                     "already, got true",
                     configuration_file)},
        kWrongConfiguration);
  }
  auto setup = prepare_replay(given->replay.recording->string(), configuration_file, ReadMode::kStrict);
  if (!setup) return refuse(setup.error().error, setup.error().configuration ? kWrongConfiguration : kFailure);
  return run_session(configuration_file, *given, setup->configuration, setup->pipeline, setup->identity, *stop,
                     [&setup](SensorEntrance& entrance) {
                       return std::make_unique<ReplayFeeder>(std::move(setup->reader), SensorIntake{&entrance});
                     });
}

int parse_and_run(int argc, char** argv) {
  CLI::App app{
      "Maps a beating organ and publishes its predicted surface over DDS at a fixed latency.\n"
      "Research software, not a certified medical device.",
      "perimapd"};
  app.set_version_flag("--version", PERIMAP_VERSION);
  std::string configuration_file;
  app.add_option("-c,--config", configuration_file, "Configuration file (TOML; see config/replay.toml)")->required();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kWrongConfiguration;
  }
  return run(configuration_file);
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

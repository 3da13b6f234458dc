// `perimap record`: what the devices of a configuration give, into a recording.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "daemon/command_line/commands.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/logging/logging.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/runtime/configured_scope.hpp"
#include "daemon/runtime/device_feeder.hpp"
#include "daemon/runtime/device_setup.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "daemon/runtime/session_recorder.hpp"
#include "daemon/runtime/session_recording.hpp"
#include "drivers/calibration/calibration_file.hpp"
#include "drivers/calibration/turned_scope_file.hpp"

namespace perimap {
namespace {

struct RecordOptions {
  std::string configuration;
  std::filesystem::path out;
  double seconds = 0.0;  // 0: until stopped
};

std::string progress_line(const SessionRecorder& recorder, double elapsed_s) {
  const SessionRecorder::Summary summary = recorder.summary();
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(recorder.file(), error);
  const double megabytes = error ? 0.0 : static_cast<double>(bytes) / 1e6;
  return fmt::format("{:.0f} s: {} messages recorded, {:.0f} MB; not recorded: {} frames, {} others", elapsed_s,
                     summary.recorded, megabytes, summary.frames_not_recorded, summary.other_not_recorded);
}

// The configuration that holds, with what a played recording brings along, and its camera.
struct Basis {
  Configuration configuration;
  std::optional<CameraModel> camera;
  std::optional<TurnedScope> turned_scope;
};

tl::expected<Basis, SetupError> basis_of(const RecordOptions& options) {
  auto given = load_configuration(options.configuration);
  if (!given) return wrong_setup(std::move(given.error()));
  if (given->camera.playback) {
    auto recorded = recorded_basis(given->camera.playback->string(), options.configuration, ReadMode::kStrict);
    if (!recorded) return tl::unexpected(std::move(recorded.error()));
    return Basis{std::move(recorded->configuration), recorded->camera, recorded->turned_scope};
  }
  Basis basis{std::move(*given), std::nullopt, std::nullopt};
  if (basis.configuration.camera.calibration) {
    auto camera = read_calibration(*basis.configuration.camera.calibration);
    if (!camera) {
      return wrong_setup(told_in(options.configuration, {{"camera.calibration", camera.error().message}}));
    }
    basis.camera = *camera;
    auto scope = configured_scope(basis.configuration, *camera);
    if (!scope) return wrong_setup(told_in(options.configuration, std::move(scope.error())));
    basis.turned_scope = *scope;
  }
  return basis;
}

// Until the signal, the end of what is played, the limit or an error of the disk.
void watch(const RecordOptions& options, const Console& console, StopSignal& stop, DeviceFeeder& feeder) {
  constexpr Duration kTick = std::chrono::milliseconds(100);
  constexpr Duration kReport = std::chrono::seconds(5);
  const Instant start = MonotonicClock::now();
  Instant reported = start;
  while (!stop.wait_for(kTick) && !feeder.ended()) {
    feeder.tick();
    const Instant now = MonotonicClock::now();
    if (feeder.recorder()->summary().stopped) return;
    if (options.seconds > 0.0 && now - start >= from_seconds(options.seconds)) return;
    if (now - reported < kReport) continue;
    reported = now;
    console.complain(progress_line(*feeder.recorder(), to_seconds(now - start)));
  }
}

Outcome record(const RecordOptions& options, const Console& console) {
  auto stop = StopSignal::install();
  if (!stop) return refuse(stop.error());
  auto basis = basis_of(options);
  if (!basis) return refuse(basis.error());
  auto devices = named_devices(basis->configuration, options.configuration);
  if (!devices) return refuse(told_in(options.configuration, devices.error()), ExitCode::kWrongUsage);
  if (!devices->tracker && !devices->ecg && !devices->r_trigger && !devices->camera) {
    return refuse(options.configuration + ": names no device; expected [camera], [tracker] or [ecg]",
                  ExitCode::kWrongUsage);
  }
  SensorRecordingFacts facts = recording_facts(basis->configuration, basis->camera, "perimap record " PERIMAP_VERSION);
  if (basis->turned_scope) facts.turned_scope = format_turned_scope(*basis->turned_scope);
  auto recorder = SessionRecorder::create(options.out, facts,
                                          static_cast<std::size_t>(basis->configuration.recording.memory_MB) << 20U);
  if (!recorder) return refuse(recorder.error());

  const Logging logging(console.name(), basis->configuration.log.level);
  const Instant start = MonotonicClock::now();
  DeviceFeeder feeder(std::move(*devices), nullptr, {std::move(*recorder), {}});
  ThreadLauncher threads({});
  feeder.start(threads);
  watch(options, console, *stop, feeder);
  feeder.stop();

  const SessionRecorder& ended = *feeder.recorder();
  fmt::print("{}: {}\n", ended.file().string(), progress_line(ended, to_seconds(MonotonicClock::now() - start)));
  if (feeder.error()) return refuse(*feeder.error());
  const SessionRecorder::Summary summary = ended.summary();
  if (summary.stopped) return refuse(ended.reason());
  const std::uint64_t lost = summary.frames_not_recorded + summary.other_not_recorded;
  if (lost > 0) return refuse(fmt::format("{} messages found no room: the disk did not keep up", lost));
  if (summary.recorded == 0) {
    return refuse(fmt::format("no device gave anything: perimap probe {} says why", options.configuration));
  }
  return {};
}

}  // namespace

void add_record_command(Commands& commands) {
  const auto options = std::make_shared<RecordOptions>();
  Command& command =
      commands.add("record", "Record what the devices of a configuration give, as it comes, until stopped",
                   [options](const Console& console) { return record(*options, console); });
  command.add_option("-c,--config", options->configuration, "Configuration of perimapd (TOML)")->required();
  command.add_option("OUT", options->out, "The recording to write (.mcap); it must not be there yet")->required();
  command.add_option("--seconds", options->seconds, "How long, s [until stopped]")->check(Range(0.1, 1e6));
}

}  // namespace perimap

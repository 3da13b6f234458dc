// `perimap record`: what the devices of a configuration give, into a recording.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "daemon/command_line/commands.hpp"
#include "daemon/config/wrong_key.hpp"
#include "daemon/logging/logging.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/runtime/device_feeder.hpp"
#include "daemon/runtime/device_setup.hpp"
#include "daemon/runtime/last_verification.hpp"
#include "daemon/runtime/recording_run.hpp"
#include "daemon/runtime/session_recorder.hpp"
#include "daemon/runtime/session_recording.hpp"
#include "drivers/calibration/turned_scope_file.hpp"

namespace perimap {
namespace {

struct RecordOptions {
  std::string configuration;
  std::filesystem::path out;
  double seconds = 0.0;  // 0: until stopped
};

Outcome record(const RecordOptions& options, const Console& console) {
  auto stop = StopSignal::install();
  if (!stop) return refuse(stop.error());
  auto basis = recording_basis(options.configuration);
  if (!basis) return refuse(basis.error());
  auto devices = named_devices(basis->configuration, options.configuration);
  if (!devices) return refuse(told_in(options.configuration, devices.error()), ExitCode::kWrongUsage);
  if (!devices->tracker && !devices->ecg && !devices->r_trigger && !devices->camera) {
    return refuse(options.configuration + ": names no device; expected [camera], [tracker] or [ecg]",
                  ExitCode::kWrongUsage);
  }
  SensorRecordingFacts facts = recording_facts(basis->configuration, basis->camera, "perimap record " PERIMAP_VERSION);
  if (basis->turned_scope) facts.turned_scope = format_turned_scope(*basis->turned_scope);
  facts.verification = last_verification(options.configuration, basis->configuration, basis->camera).text;
  auto recorder = SessionRecorder::create(options.out, facts,
                                          static_cast<std::size_t>(basis->configuration.recording.memory_MB) << 20U);
  if (!recorder) return refuse(recorder.error());

  const Logging logging(console.name(), basis->configuration.log.level);
  const Instant start = MonotonicClock::now();
  DeviceFeeder feeder(std::move(*devices), nullptr, {std::move(*recorder), {}});
  ThreadLauncher threads({});
  feeder.start(threads);
  const auto limit = options.seconds > 0.0 ? std::optional(from_seconds(options.seconds)) : std::nullopt;
  record_until_ended(feeder, *stop, limit, [&](const std::string& line) { console.complain(line); });
  feeder.stop();

  const SessionRecorder& ended = *feeder.recorder();
  fmt::print("{}: {}\n", ended.file().string(), progress_line(ended, MonotonicClock::now() - start));
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

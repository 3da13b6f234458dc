// `perimap probe`: whether the devices are there, and well.
#include <fmt/format.h>

#include <memory>
#include <string>

#include "daemon/command_line/commands.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/probe/device_probe.hpp"
#include "daemon/probe/probe_report.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/runtime/setup_warnings.hpp"
#include "drivers/json/json_text.hpp"

namespace perimap {
namespace {

struct ProbeOptions {
  std::string file;
  double seconds = 5.0;
  bool json = false;
};

// What plays in step with a playback has nothing to say before that begins. False: a signal came.
bool wait_for_playback(const CameraConfiguration& camera, StopSignal& stop, const Console& console) {
  if (!camera.playback || camera.playback_start_s <= 0.0) return true;
  const Duration left = Instant(from_seconds(camera.playback_start_s)) - MonotonicClock::now();
  if (left <= Duration(0)) return true;
  console.complain(fmt::format("the playback begins in {:.1f} s: listening from then on", to_seconds(left)));
  return !stop.wait_for(left);
}

Outcome probe(const ProbeOptions& options, const Console& console) {
  auto stop = StopSignal::install();
  if (!stop) return refuse(stop.error());
  auto configuration = load_configuration(options.file, {}, NamedFiles::kMayBeMissing);
  if (!configuration) return refuse(configuration.error(), ExitCode::kWrongUsage);
  const CameraConfiguration camera = configuration->camera;
  // A playback is no device.
  configuration->camera.playback.reset();
  const auto devices = named_devices(*configuration, options.file);
  if (!devices) return refuse(told_in(options.file, devices.error()), ExitCode::kWrongUsage);
  if (!devices->camera && !devices->tracker && !devices->ecg && !devices->r_trigger) {
    return refuse(
        options.file + ": names no device; expected keys 'camera.device', 'tracker.protocol' or 'ecg.protocol'",
        ExitCode::kWrongUsage);
  }
  for (const std::string& line : setup_warnings(*configuration)) console.complain("warning: " + line);
  if (!wait_for_playback(camera, *stop, console)) return refuse("stopped before it began to listen");
  const ProbedDevices probed = probe_devices(*configuration, *devices, from_seconds(options.seconds), *stop);
  if (stop->requested()) console.complain("stopped early");
  fmt::print("{}", options.json ? json_document(to_json(probed)) : to_text(probed));
  // What is not well has been told.
  if (!all_well(probed)) return refuse("");
  return {};
}

}  // namespace

void add_probe_command(Commands& commands) {
  const auto options = std::make_shared<ProbeOptions>();
  Command& command =
      commands.add("probe", "Opens each device of a configuration and tells whether it is there and well",
                   [options](const Console& console) { return probe(*options, console); });
  command.add_option("FILE", options->file, "Configuration of perimapd (TOML)")->required();
  command.add_option("--seconds", options->seconds, "How long to listen, s")
      ->check(Range(0.1, 3600.0))
      ->capture_default_str();
  command.add_flag("--json", options->json, "Print JSON");
}

}  // namespace perimap

// `perimap emulate`: stands in for devices.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/command_line/choice.hpp"
#include "daemon/command_line/commands.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/standins/options/simulation_options.hpp"
#include "drivers/standins/theatre/served_devices.hpp"
#include "drivers/standins/theatre/theatre.hpp"
#include "drivers/standins/theatre/theatre_words.hpp"

namespace perimap {
namespace {

using NdiNewest = NdiEmulatorSettings::Newest;
using IgtlKind = IgtlEmulatorSettings::Message;

struct EmulateOptions {
  std::vector<std::string> devices;  // NAME or NAME=WHERE
  std::string setup;                 // folder
  SimulationOptions simulation{600.0};
  std::optional<double> start_s;
  TheatreWords words;
  TheatreSettings theatre;
  std::vector<const Option*> can_options = {};
  [[nodiscard]] bool can_given() const {
    return std::any_of(can_options.begin(), can_options.end(), [](const auto* option) { return option->count() > 0; });
  }
};

Expected<TheatreSettings> settings_of(const EmulateOptions& options) {
  auto settings = with_words(options.theatre, options.words);
  if (!settings) return settings;
  auto heart = options.simulation.settings();
  if (!heart) return tl::unexpected(heart.error());
  settings->faults.seed = options.simulation.seed();
  settings->heart = std::move(*heart);
  settings->noise = options.simulation.noise();
  settings->breath = options.simulation.breath();
  return settings;
}

void tell(const std::string& line) {
  fmt::print("{}\n", line);
  (void)std::fflush(stdout);
}

Outcome emulate(const EmulateOptions& options, const Console& console) {
  const auto devices = parse_emulated_devices(options.devices, options.theatre, options.can_given());
  if (!devices) return refuse(devices.error(), ExitCode::kWrongUsage);
  const auto settings = settings_of(options);
  if (!settings) return refuse(settings.error(), ExitCode::kWrongUsage);
  auto stop = StopSignal::install();
  if (!stop) return refuse(stop.error());
  const bool camera = std::any_of(devices->begin(), devices->end(),
                                  [](const EmulatedDevice& device) { return !device.video_output.empty(); });
  auto theatre = Theatre::create(*settings, camera);
  if (!theatre) {
    return refuse(theatre.error(), settings->recording.empty() ? ExitCode::kWrongUsage : ExitCode::kFailed);
  }
  if (!options.setup.empty()) {
    if (!theatre->has_simulation()) {
      return refuse("--setup: expected the device 'camera', and no --recording", ExitCode::kWrongUsage);
    }
    if (auto written = theatre->write_setup(options.setup); !written) return refuse(written.error());
  }
  theatre->set_start(options.start_s ? Instant(from_seconds(*options.start_s)) : MonotonicClock::now());
  constexpr Duration kTick = std::chrono::milliseconds(100);
  const auto complain = [&](const std::string& line) { console.complain(line); };
  if (serve_devices(*theatre, *devices, tell, complain, [&] { return stop->wait_for(kTick); })) return {};
  return refuse("");  // which device, and why, has been told
}

void add_tracker_options(Command& command, EmulateOptions& options) {
  TheatreSettings& theatre = options.theatre;
  add_choice(command, "--ndi-newest", theatre.ndi.newest,
             {{"bx2", NdiNewest::kBx2}, {"bx", NdiNewest::kBx}, {"tx", NdiNewest::kTx}},
             "Newest query that the NDI tracker knows [bx2]");
  command.add_option("--ndi-tools", theatre.ndi.wired_tools, "Tools in its ports; 0: all are uploaded")
      ->check(Range(0, 8))
      ->capture_default_str();
  command
      .add_option("--ndi-reference", options.words.ndi_reference,
                  "TX TY TZ W X Y Z, mm and unit quaternion: where the second tool of the NDI tracker is, the "
                  "patient's reference; it stays there [missing]")
      ->expected(7);
  command.add_option("--tool", options.words.tools,
                     "NAME=MOTION: a further tool of the tracker, by its port handle (NDI: 0B, ...) or name "
                     "(OpenIGTLink): sway, pivot[:X,Y,Z] about a tip in the tool's frame, still:TX,TY,TZ,W,X,Y,Z, or a "
                     "file of poses in metres, t_s,x,y,z,qx,qy,qz,qw; once for each tool");
  command.add_option("--ndi-broken", options.words.broken,
                     "Port handle of a tool that cannot be initialised (ERROR13)");
  command.add_option("--ndi-error", theatre.ndi.error_mm, "RMS error that the NDI tracker says its poses have, mm")
      ->check(Range(0.0, 9.0));
  command
      .add_option("--ndi-frame-jump", options.words.frame_jump,
                  "EVERY BY: every so many seconds the frame numbers jump by so many, or go back")
      ->expected(2)
      ->check(Range(-1e6, 1e6));
  using Stamps = IgtlEmulatorSettings::Stamps;
  add_choice(command, "--igtl-stamps", theatre.igtl.stamps,
             {{"seconds", Stamps::kSeconds},
              {"milliseconds", Stamps::kMilliseconds},
              {"microseconds", Stamps::kMicroseconds},
              {"whole-seconds", Stamps::kWholeSeconds},
              {"nanosecond-fraction", Stamps::kNanosecondFraction},
              {"counts", Stamps::kCounts},
              {"none", Stamps::kNone}},
             "What the OpenIGTLink server stamps with [seconds]");
  command
      .add_option("--igtl-clock", theatre.igtl.clock_rate, "Seconds of the OpenIGTLink server's clock in one of ours")
      ->check(Range(0.01, 100.0))
      ->capture_default_str();
  add_choice(command, "--igtl-message", theatre.igtl.message,
             {{"transform", IgtlKind::kTransform}, {"tdata", IgtlKind::kTdata}, {"position", IgtlKind::kPosition}},
             "What the OpenIGTLink server sends [transform]");
  command.add_option("--igtl-version", theatre.igtl.version, "OpenIGTLink header version")
      ->check(Range(1U, 2U))
      ->capture_default_str();
  command.add_option("--igtl-tool", theatre.igtl.tool, "Name of the tool")->capture_default_str();
}

}  // namespace

void add_emulate_command(Commands& commands) {
  const auto options = std::make_shared<EmulateOptions>();
  Command& command = commands.add(
      "emulate",
      "Stand in for devices: the real protocols on pseudo-terminals, TCP ports, CAN and video outputs, until stopped",
      [options](const Console& console) { return emulate(*options, console); });
  TheatreSettings& theatre = options->theatre;
  command
      .add_option("DEVICE", options->devices,
                  "ndi, igtl (trackers), medlab, bitalino, cyton, can-ecg; NAME=WHERE puts one elsewhere than at its "
                  "usual place: a link to a pseudo-terminal (absolute path), tcp:127.0.0.1:PORT or can:INTERFACE; "
                  "camera=v4l2:/dev/videoN plays frames out of that video output")
      ->required();
  command.add_option("--recording", theatre.recording, "Play this recording, once [a simulated heart and scope]");
  command.add_option(
      "--start", options->start_s,
      "When the recording or the simulated heart begins, s on CLOCK_MONOTONIC, so that several play in step "
      "[now]");
  command.add_option("--setup", options->setup,
                     "Write the calibration of the simulated camera, and what else perimapd is to know of it, to "
                     "camera.yaml and scene.toml in this folder");
  EmulatorFaults& faults = theatre.faults;
  const auto probability = Range(0.0, 1.0);
  command.add_option("--bad-check", faults.bad_check, "Part of the messages with a wrong check sum")
      ->check(probability);
  command.add_option("--garbled", faults.garbled, "Part of the messages with a wrong byte")->check(probability);
  command.add_option("--truncated", faults.truncated, "Part of the messages without their end")->check(probability);
  command.add_option("--lost", faults.lost, "Part of the messages that are left out")->check(probability);
  command.add_option("--drift", faults.drift_ppm, "How much the device's clock runs fast, ppm")
      ->check(Range(-5000.0, 5000.0));
  const auto seconds = Range(0.01, 86400.0);
  command.add_option("--missing", options->words.missing_s, "EVERY FOR, s: the tool is out of sight, the lead is off")
      ->expected(2)
      ->check(seconds);
  command.add_option("--unplug", options->words.unplug_s, "EVERY FOR, s: the device is unplugged")
      ->expected(2)
      ->check(seconds);
  add_tracker_options(command, *options);
  command.add_flag("--second-lead", theatre.second_lead,
                   "A BITalino has a second lead, made of the first, on A3, a Cyton on input 2 "
                   "(ecg.second_channel); --missing then takes off the first alone");
  command.add_flag("--cyton-daisy", theatre.cyton_daisy, "The Cyton has a Daisy module, as its greeting says");
  options->can_options = {
      command.add_option("--can-identifier", theatre.can.identifier, "Of the frames over CAN, as 736 or 0x2E0")
          ->check(Range(0U, 0x1FFFFFFFU))
          ->capture_default_str(),
      command.add_flag("--can-extended", theatre.can.extended, "That identifier has 29 bits"),
      command.add_option("--can-rate", theatre.can.sample_rate_hz, "Samples a second over CAN")
          ->check(Range(100.0, 1000.0))
          ->capture_default_str(),
      command.add_option("--can-count", theatre.can.count_mV, "mV that a count of these samples stands for")
          ->check(Range(1e-6, 1000.0))
          ->capture_default_str()};
  // One heart for all devices; where a camera is to see it, for so long as --duration says.
  options->simulation.add_to(command.add_option_group("Simulated heart"));
}

}  // namespace perimap

// `perimap setup`: a configuration for the devices that are there.
#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <tuple>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/probe/device_probe.hpp"
#include "daemon/probe/probe_report.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/setup/attached_devices.hpp"
#include "daemon/setup/device_choice.hpp"
#include "daemon/setup/first_configuration.hpp"
#include "daemon/setup/kept_result.hpp"

namespace perimap {
namespace {

struct SetupOptions {
  std::string output = "perimap.toml";
  std::string camera;   // what is not given is asked, or found
  std::string tracker;  // PROTOCOL=PORT
  std::string ecg;      // likewise
  std::string calibration;
  double seconds = 3.0;
};

// One of the choices by its number, or what is typed; empty at the end of the input, and for 0.
std::string ask(const std::string& question, const std::vector<DeviceChoice>& choices) {
  fmt::print("{}\n  0: none\n", question);
  for (std::size_t i = 0; i < choices.size(); ++i) fmt::print("  {}: {}\n", i + 1, choices[i].what);
  fmt::print("A number, or what else it is [{}]: ", choices.empty() ? 0 : 1);
  (void)std::fflush(stdout);
  std::string line;
  if (!std::getline(std::cin, line)) return "";
  if (line.empty()) return choices.empty() ? "" : choices.front().value;
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), number);
  if (error == std::errc{} && end == line.data() + line.size()) {
    return number >= 1 && number <= choices.size() ? choices[number - 1].value : "";
  }
  return line;
}

// What was given; else, at a terminal, what is asked, and elsewhere the only one that is plausible.
Expected<SetupAnswers> answers_of(const SetupOptions& options, bool interactive) {
  const auto chosen = [&](const std::string& given, const std::string& question, const std::vector<DeviceChoice>& all,
                          const std::vector<DeviceChoice>& plausible) {
    if (!given.empty()) return given == "none" ? std::string() : given;
    if (interactive) return ask(question, all);
    return plausible.size() == 1 ? plausible.front().value : std::string();
  };
  SetupAnswers answers;
  const auto cameras = camera_choices(attached_cameras());
  answers.camera = chosen(options.camera, "Which is the scope's camera?", cameras, cameras);
  answers.calibration = options.calibration;
  const std::vector<AttachedPort> ports = attached_ports();
  const auto port = [&](const std::string& given, const std::string& question, std::string AttachedPort::*guess,
                        const std::vector<std::string>& protocols) {
    return chosen(given, question, port_choices(ports, guess, protocols), port_choices(ports, guess, {}));
  };
  const std::string tracker_text = port(options.tracker, "Which is the tracker? (ndi=PORT, or igtl=tcp:HOST:18944)",
                                        &AttachedPort::tracker, kTrackerProtocols);
  const std::string ecg_text =
      port(options.ecg, "Which is the ECG device? (cyton=PORT, bitalino=PORT, medlab=PORT, can=can:INTERFACE)",
           &AttachedPort::ecg, kEcgProtocols);
  const auto tracker = parse_named_port("--tracker", tracker_text, kTrackerProtocols);
  if (!tracker) return tl::unexpected(tracker.error());
  const auto ecg = parse_named_port("--ecg", ecg_text, kEcgProtocols);
  if (!ecg) return tl::unexpected(ecg.error());
  answers.tracker_protocol = tracker->protocol;
  answers.tracker_port = tracker->port;
  answers.ecg_protocol = ecg->protocol;
  answers.ecg_port = ecg->port;
  return answers;
}

// What the devices say of themselves, as comments below the text.
Expected<std::string> probed(const std::string& text, const SetupOptions& options) {
  const auto configuration = parse_configuration(text, options.output, {}, NamedFiles::kMayBeMissing);
  if (!configuration) return tl::unexpected(configuration.error());
  const auto devices = named_devices(*configuration, options.output);
  if (!devices) return tl::unexpected(told_in(options.output, text, devices.error()));
  if (options.seconds <= 0.0 || (!devices->camera && !devices->tracker && !devices->ecg)) return std::string();
  auto stop = StopSignal::install();
  if (!stop) return tl::unexpected(stop.error());
  fmt::print("listening to the devices for {:g} s\n", options.seconds);
  (void)std::fflush(stdout);
  const ProbedDevices found = probe_devices(*configuration, *devices, from_seconds(options.seconds), *stop);
  return to_text(found);
}

Outcome setup(const SetupOptions& options, const Console& console) {
  const bool interactive = ::isatty(STDIN_FILENO) != 0 && ::isatty(STDOUT_FILENO) != 0;
  const auto answers = answers_of(options, interactive);
  if (!answers) return refuse(answers.error(), ExitCode::kWrongUsage);
  const std::string date = date_now();
  const std::string text = first_configuration(*answers, options.output, date);
  const auto report = probed(text, options);
  if (!report) return refuse(report.error(), ExitCode::kWrongUsage);
  if (const auto written = write_kept(options.output, text); !written) return refuse(written.error());
  fmt::print("{}{}: written\n", *report, options.output);
  for (const auto& [missing, what, option] :
       {std::tuple(answers->camera.empty(), "camera", "--camera v4l2:/dev/videoN"),
        std::tuple(answers->tracker_protocol.empty(), "tracker", "--tracker ndi=PORT or igtl=tcp:HOST:18944"),
        std::tuple(answers->ecg_protocol.empty(), "ECG device", "--ecg cyton=PORT")}) {
    if (missing) {
      console.complain(
          fmt::format("no {} is in it: none was named, and not one alone was found; name it with {}", what, option));
    }
  }
  fmt::print("next: perimap probe {0}, then perimap record -c {0} board.mcap --seconds 40 with a board in view\n",
             options.output);
  return {};
}

}  // namespace

void add_setup_command(Commands& commands) {
  const auto options = std::make_shared<SetupOptions>();
  Command& command =
      commands.add("setup", "Asks what is there, listens to it, and writes a configuration with comments",
                   [options](const Console& console) { return setup(*options, console); });
  command.footer("What is not named is asked at a terminal; elsewhere a device is taken when it alone can be the one.");
  command
      .add_option("--output", options->output, "The configuration to write; one that is there is kept with its date")
      ->capture_default_str();
  command.add_option("--camera", options->camera, "v4l2:/dev/..., video:FILE, or none");
  command.add_option("--tracker", options->tracker, "ndi=PORT, igtl=tcp:HOST:PORT, or none");
  command.add_option("--ecg", options->ecg, "cyton=PORT, bitalino=PORT, medlab=PORT, can=can:INTERFACE, or none");
  command.add_option("--calibration", options->calibration, "The camera's calibration file, where there is one");
  command.add_option("--seconds", options->seconds, "How long to listen to the devices; 0: not at all")
      ->check(Range(0.0, 600.0))
      ->capture_default_str();
}

}  // namespace perimap

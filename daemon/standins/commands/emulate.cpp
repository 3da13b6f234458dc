#include "daemon/standins/commands/emulate.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/geometry/pose.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/standins/commands/simulation_options.hpp"
#include "drivers/ecg/can_ecg.hpp"
#include "drivers/standins/emulator/camera_emulator.hpp"
#include "drivers/standins/emulator/can_ecg_emulator.hpp"
#include "drivers/standins/emulator/ecg_emulator.hpp"
#include "drivers/standins/emulator/emulator_server.hpp"
#include "drivers/standins/emulator/igtl_emulator.hpp"
#include "drivers/standins/emulator/ndi_emulator.hpp"
#include "drivers/standins/emulator/played_session.hpp"
#include "drivers/standins/emulator/recorded_frames.hpp"
#include "drivers/standins/emulator/simulated_frames.hpp"
#include "drivers/standins/session/session_writer.hpp"
#include "drivers/standins/simulator/frame_renderer.hpp"
#include "drivers/text_file/text_file.hpp"
#include "drivers/transport/camera_endpoint.hpp"
#include "drivers/transport/endpoint.hpp"

namespace perimap {
namespace {

using NdiNewest = NdiEmulatorSettings::Newest;
using IgtlKind = IgtlEmulatorSettings::Message;

const std::map<std::string, std::string> kUsualPlaces{
    {"ndi", "tcp:127.0.0.1:8765"},         {"igtl", "tcp:127.0.0.1:18944"}, {"medlab", "/tmp/perimap-medlab"},
    {"bitalino", "/tmp/perimap-bitalino"}, {"cyton", "/tmp/perimap-cyton"}, {"can-ecg", "can:vcan0"}};

struct Options {
  std::vector<std::string> devices;  // NAME or NAME=WHERE
  std::string recording;
  std::string setup;  // folder
  SimulationOptions simulation{600.0};
  std::optional<double> start_s;
  std::vector<double> missing_s;
  std::vector<double> unplug_s;
  std::vector<double> ndi_reference;  // translation, then rotation wxyz
  EmulatorFaults faults;
  NdiEmulatorSettings ndi{.wired_tools = 1};
  IgtlEmulatorSettings igtl;
  CanEcgSettings can;
  std::vector<const CLI::Option*> can_options = {};
  [[nodiscard]] bool can_given() const {
    return std::any_of(can_options.begin(), can_options.end(), [](const auto* option) { return option->count() > 0; });
  }
};

struct Device {
  std::string name;
  Endpoint where;
  std::string video_output = {};  // of a camera, in its place
};

int complain(const Error& error, int exit_code) {
  fmt::print(stderr, "perimap emulate: {}\n", error.message);
  return exit_code;
}

Expected<Device> parse_camera(const std::string& where) {
  const auto endpoint = parse_camera_endpoint(where);
  const auto* output = endpoint ? std::get_if<V4l2Endpoint>(&*endpoint) : nullptr;
  if (output == nullptr) {
    return fail(fmt::format("device 'camera': expected camera=v4l2:/dev/videoN of a video output, got '{}'", where));
  }
  return Device{"camera", {}, output->path};
}

Expected<Device> parse_device(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string name = text.substr(0, equals);
  if (name == "camera") return parse_camera(equals == std::string::npos ? "" : text.substr(equals + 1));
  const auto usual = kUsualPlaces.find(name);
  if (usual == kUsualPlaces.end()) {
    return fail(
        fmt::format("device '{}': expected ndi, igtl, medlab, bitalino, cyton, can-ecg or camera, then =WHERE", name));
  }
  auto where = parse_endpoint(equals == std::string::npos ? usual->second : text.substr(equals + 1));
  if (!where) return fail(fmt::format("device '{}': {}", name, where.error().message));
  if (std::holds_alternative<CanEndpoint>(*where) != (name == "can-ecg")) {
    return fail(fmt::format("device '{}': cannot be at {}", name, format_endpoint(*where)));
  }
  if (const auto* tcp = std::get_if<TcpEndpoint>(&*where)) {
    if (tcp->host != "127.0.0.1" && tcp->host != "localhost") {
      return fail(fmt::format("device '{}': listens on this host alone, at tcp:127.0.0.1:{}", name, tcp->port));
    }
  }
  return Device{name, std::move(*where)};
}

// Over CAN, and out of a video output, there are no bytes to damage.
Expected<void> check_faults(const Device& device, const EmulatorFaults& faults) {
  const bool can = device.name == "can-ecg";
  const bool camera = !device.video_output.empty();
  const auto refuse = [&device](const char* option, const char* why) {
    return fail(fmt::format("device '{}': cannot do {}: {}", device.name, option, why));
  };
  constexpr const char* kWholeFrames = "CAN controllers pass on whole, undamaged frames only";
  constexpr const char* kPictures = "frames of a video output have no check sums and no protocol";
  if (faults.bad_check > 0.0 && (can || camera)) return refuse("--bad-check", can ? kWholeFrames : kPictures);
  if (faults.garbled > 0.0 && (can || camera)) return refuse("--garbled", can ? kWholeFrames : kPictures);
  if (faults.truncated > 0.0 && can) return refuse("--truncated", kWholeFrames);
  return {};
}

Expected<void> check_can_frame(const Options& options, const std::vector<Device>& devices) {
  const auto is_can = [](const Device& device) { return device.name == "can-ecg"; };
  if (options.can_given() && std::none_of(devices.begin(), devices.end(), is_can)) {
    return fail("--can-...: expected the device 'can-ecg'");
  }
  constexpr std::uint32_t kLargest = CanEcgSettings::kLargestStandardIdentifier;
  if (!options.can.extended && options.can.identifier > kLargest) {
    return fail(fmt::format("--can-identifier: expected at most 0x{:X} without --can-extended, got 0x{:X}", kLargest,
                            options.can.identifier));
  }
  return {};
}

// The second tool's place, as given on the command line.
Expected<Pose> reference_of(const std::vector<double>& given) {
  const Vector3d t_mm(given[0], given[1], given[2]);
  const double wxyz[4] = {given[3], given[4], given[5], given[6]};
  const double norm = std::sqrt(wxyz[0] * wxyz[0] + wxyz[1] * wxyz[1] + wxyz[2] * wxyz[2] + wxyz[3] * wxyz[3]);
  if (!(std::abs(norm - 1.0) < 1e-3)) {
    return fail(fmt::format("--ndi-reference: expected a rotation W X Y Z of norm 1 within 1e-3, got norm {:g}", norm));
  }
  return pose_from_wxyz(t_mm, wxyz);
}

// Where the data of the emulated devices comes from.
struct Theatre {
  const Options& options;
  Instant start;
  std::optional<Simulation> simulation = {};  // the heart that an emulated camera sees, where no recording is played
  std::optional<PlayedSession> session = {};  // that, or the recording; none: a scope and a heart without an end

  [[nodiscard]] PoseTrack poses() const {
    constexpr double kRate_hz = 60.0;
    return session ? session->poses(start) : PoseTrack::swaying(start, kRate_hz);
  }
  [[nodiscard]] Expected<EcgDeviceSignals> ecg_device() const {
    if (session) return session->ecg_device(start);
    auto ecg = SampledWaveform::ecg_of_record(options.simulation.ecg_record(), start);
    if (!ecg) return tl::unexpected(std::move(ecg.error()));
    EcgDeviceSignals signals{std::move(*ecg)};
    if (const auto breath = options.simulation.breath()) {
      signals.respiration = SampledWaveform::breathing(*breath, start);
    }
    return signals;
  }
  [[nodiscard]] Expected<std::unique_ptr<PlayedFrames>> frames() const {
    if (simulation) return std::make_unique<SimulatedFrames>(*simulation);
    return RecordedFrames::open(options.recording).map([](RecordedFrames frames) -> std::unique_ptr<PlayedFrames> {
      return std::make_unique<RecordedFrames>(std::move(frames));
    });
  }
};

Expected<std::unique_ptr<DeviceProtocol>> make(const Device& device, const Theatre& theatre) {
  const Options& o = theatre.options;
  if (device.name == "ndi") return std::make_unique<NdiEmulator>(theatre.poses(), o.ndi, o.faults);
  if (device.name == "igtl") return std::make_unique<IgtlEmulator>(theatre.poses(), o.igtl, o.faults);
  auto ecg = theatre.ecg_device();
  if (!ecg) return tl::unexpected(std::move(ecg.error()));
  if (device.name == "medlab") return emulate_medlab(std::move(*ecg), o.faults);
  if (device.name == "bitalino") return emulate_bitalino(std::move(*ecg), o.faults);
  return emulate_cyton(std::move(*ecg), o.faults);
}

Expected<void> serve(const Device& device, const Theatre& theatre, const Interrupt& interrupt) {
  const auto ready = [&device](const std::string& where) {
    fmt::print("{} at {}\n", device.name, where);
    (void)std::fflush(stdout);
  };
  if (!device.video_output.empty()) {
    const auto frames = theatre.frames();
    if (!frames) return tl::unexpected(frames.error());
    const auto played =
        emulate_camera(device.video_output, **frames, theatre.start, theatre.options.faults, ready, interrupt);
    if (!played) return tl::unexpected(played.error());
    fmt::print(
        "camera: {} frames shown, {} of them cut; {} left out, {} found the output busy, {} not rendered in time\n",
        played->shown, played->faulty, played->lost, played->refused, played->too_slow);
    (void)std::fflush(stdout);
    return {};
  }
  if (const auto* can = std::get_if<CanEndpoint>(&device.where)) {
    const auto ecg = theatre.ecg_device();
    if (!ecg) return tl::unexpected(ecg.error());
    ready(format_endpoint(device.where));
    return emulate_can_ecg(can->interface_name, *ecg, theatre.options.can, theatre.options.faults, interrupt);
  }
  const auto protocol = make(device, theatre);
  if (!protocol) return tl::unexpected(protocol.error());
  if (const auto* tcp = std::get_if<TcpEndpoint>(&device.where)) {
    return emulate_on_tcp(tcp->port, **protocol, theatre.options.faults, ready, interrupt);
  }
  return emulate_on_terminal(std::get<SerialEndpoint>(device.where).path, **protocol, theatre.options.faults, ready,
                             interrupt);
}

// What perimapd needs to know of the simulated scope: its calibration, its place in the tracked sensor.
Expected<void> write_setup(const std::filesystem::path& folder, const Simulation& simulation,
                           const TrackerNoise& noise) {
  const std::string toml = simulated_configuration(simulation, noise) + "\n[camera]\ncalibration = \"camera.yaml\"\n";
  return write_text_file(folder / "camera.yaml", simulation.lens().opencv_yaml()).and_then([&] {
    return write_text_file(folder / "scene.toml", toml);
  });
}

// Otherwise the error and the exit code.
tl::expected<void, std::pair<Error, int>> set_up(Theatre& theatre, bool camera) {
  const Options& options = theatre.options;
  const auto wrong = [](Error error, int code) { return tl::unexpected(std::pair(std::move(error), code)); };
  if (!options.recording.empty()) {
    auto session = PlayedSession::read(options.recording);
    if (!session) return wrong(std::move(session.error()), 1);
    theatre.session = std::move(*session);
  } else if (camera) {
    const auto settings = options.simulation.settings();
    if (!settings) return wrong(settings.error(), 2);
    auto simulation = Simulation::create(*settings, threaded_for(std::max(1U, std::thread::hardware_concurrency())));
    if (!simulation) return wrong(std::move(simulation.error()), 2);
    theatre.simulation.emplace(std::move(*simulation));
    theatre.session = PlayedSession::of(*theatre.simulation, options.simulation.noise());
  }
  if (!options.setup.empty()) {
    if (!theatre.simulation) return wrong({"--setup: expected the device 'camera', and no --recording"}, 2);
    const auto written = write_setup(options.setup, *theatre.simulation, options.simulation.noise());
    if (!written) return wrong(written.error(), 1);
  }
  return {};
}

int run(Options& options) {
  std::vector<Device> devices;
  bool camera = false;
  for (const std::string& text : options.devices) {
    auto device = parse_device(text);
    if (!device) return complain(device.error(), 2);
    if (const auto able = check_faults(*device, options.faults); !able) return complain(able.error(), 2);
    camera = camera || !device->video_output.empty();
    devices.push_back(std::move(*device));
  }
  const auto spans = [](const std::vector<double>& given, Duration& every, Duration& lasting) {
    if (given.size() != 2) return;
    every = from_seconds(given[0]);
    lasting = from_seconds(given[1]);
  };
  spans(options.missing_s, options.faults.missing_every, options.faults.missing_for);
  spans(options.unplug_s, options.faults.unplug_every, options.faults.unplug_for);
  options.faults.seed = options.simulation.seed();
  if (const auto frame = check_can_frame(options, devices); !frame) return complain(frame.error(), 2);

  if (!options.ndi_reference.empty()) {
    const auto reference = reference_of(options.ndi_reference);
    if (!reference) return complain(reference.error(), 2);
    options.ndi.reference = *reference;
    // Where tools are wired the reference is, too.
    if (options.ndi.wired_tools == 1) options.ndi.wired_tools = 2;
  }

  auto stop = StopSignal::install();
  if (!stop) return complain(stop.error(), 1);
  Theatre theatre{options, {}};
  if (const auto ready = set_up(theatre, camera); !ready) return complain(ready.error().first, ready.error().second);
  theatre.start = options.start_s ? Instant(from_seconds(*options.start_s)) : MonotonicClock::now();

  Interrupt interrupt;
  std::atomic<bool> failed{false};
  std::mutex messages;
  std::vector<std::jthread> threads;
  threads.reserve(devices.size());
  for (const Device& device : devices) {
    threads.emplace_back([&, device] {
      const auto served = serve(device, theatre, interrupt);
      if (served) return;
      const std::lock_guard lock(messages);
      (void)complain({fmt::format("{}: {}", device.name, served.error().message)}, 1);
      failed = true;
    });
  }
  constexpr Duration kTick = std::chrono::milliseconds(100);
  while (!failed && !stop->wait_for(kTick)) {
  }
  interrupt.request();
  threads.clear();
  return failed ? 1 : 0;
}

}  // namespace

void add_emulate_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "emulate",
      "Stand in for devices: the real protocols on pseudo-terminals, TCP ports, CAN and video outputs, until stopped");
  command
      ->add_option("DEVICE", options->devices,
                   "ndi, igtl (trackers), medlab, bitalino, cyton, can-ecg; NAME=WHERE puts one elsewhere than at its "
                   "usual place: a link to a pseudo-terminal (absolute path), tcp:127.0.0.1:PORT or can:INTERFACE; "
                   "camera=v4l2:/dev/videoN plays frames out of that video output")
      ->required();
  command->add_option("--recording", options->recording, "Play this recording, once [a simulated heart and scope]");
  command->add_option(
      "--start", options->start_s,
      "When the recording or the simulated heart begins, s on CLOCK_MONOTONIC, so that several play in step "
      "[now]");
  command->add_option("--setup", options->setup,
                      "Write the calibration of the simulated camera, and what else perimapd is to know of it, to "
                      "camera.yaml and scene.toml in this folder");
  EmulatorFaults& faults = options->faults;
  const auto probability = CLI::Range(0.0, 1.0);
  command->add_option("--bad-check", faults.bad_check, "Part of the messages with a wrong check sum")
      ->check(probability);
  command->add_option("--garbled", faults.garbled, "Part of the messages with a wrong byte")->check(probability);
  command->add_option("--truncated", faults.truncated, "Part of the messages without their end")->check(probability);
  command->add_option("--lost", faults.lost, "Part of the messages that are left out")->check(probability);
  command->add_option("--drift", faults.drift_ppm, "How much the device's clock runs fast, ppm")
      ->check(CLI::Range(-5000.0, 5000.0));
  const auto seconds = CLI::Range(0.01, 86400.0);
  command->add_option("--missing", options->missing_s, "EVERY FOR, s: the tool is out of sight, the lead is off")
      ->expected(2)
      ->check(seconds);
  command->add_option("--unplug", options->unplug_s, "EVERY FOR, s: the device is unplugged")
      ->expected(2)
      ->check(seconds);
  const std::map<std::string, NdiNewest> newest{
      {"bx2", NdiNewest::kBx2}, {"bx", NdiNewest::kBx}, {"tx", NdiNewest::kTx}};
  command->add_option("--ndi-newest", options->ndi.newest, "Newest query that the NDI tracker knows: bx2, bx, tx [bx2]")
      ->transform(CLI::Transformer(newest));
  command->add_option("--ndi-tools", options->ndi.wired_tools, "Tools in its ports; 0: all are uploaded")
      ->check(CLI::Range(0, 8))
      ->capture_default_str();
  command
      ->add_option("--ndi-reference", options->ndi_reference,
                   "TX TY TZ W X Y Z, mm and unit quaternion: where the second tool of the NDI tracker is, the "
                   "patient's reference; it stays there [missing]")
      ->expected(7);
  const std::map<std::string, IgtlKind> kinds{
      {"transform", IgtlKind::kTransform}, {"tdata", IgtlKind::kTdata}, {"position", IgtlKind::kPosition}};
  command->add_option("--igtl-message", options->igtl.message, "transform, tdata or position [transform]")
      ->transform(CLI::Transformer(kinds));
  command->add_option("--igtl-version", options->igtl.version, "OpenIGTLink header version")
      ->check(CLI::Range(1U, 2U))
      ->capture_default_str();
  command->add_option("--igtl-tool", options->igtl.tool, "Name of the tool")->capture_default_str();
  options->can_options = {
      command->add_option("--can-identifier", options->can.identifier, "Of the frames over CAN, as 736 or 0x2E0")
          ->check(CLI::Range(0U, 0x1FFFFFFFU))
          ->capture_default_str(),
      command->add_flag("--can-extended", options->can.extended, "That identifier has 29 bits"),
      command->add_option("--can-rate", options->can.sample_rate_hz, "Samples a second over CAN")
          ->check(CLI::Range(100.0, 1000.0))
          ->capture_default_str(),
      command->add_option("--can-count", options->can.count_mV, "mV that a count of these samples stands for")
          ->check(CLI::Range(1e-6, 1000.0))
          ->capture_default_str()};
  // One heart for all devices; where a camera is to see it, for so long as --duration says.
  options->simulation.add_to(*command->add_option_group("Simulated heart"));
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace perimap

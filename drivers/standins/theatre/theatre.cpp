#include "drivers/standins/theatre/theatre.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string_view>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "drivers/standins/emulator/camera_emulator.hpp"
#include "drivers/standins/emulator/can_ecg_emulator.hpp"
#include "drivers/standins/emulator/ecg_emulator.hpp"
#include "drivers/standins/emulator/emulator_server.hpp"
#include "drivers/standins/emulator/recorded_frames.hpp"
#include "drivers/standins/emulator/simulated_frames.hpp"
#include "drivers/standins/session/session_writer.hpp"
#include "drivers/standins/simulator/frame_renderer.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {

Expected<Theatre> Theatre::create(const TheatreSettings& settings, bool with_camera) {
  Theatre theatre(settings);
  if (!settings.recording.empty()) {
    auto session = PlayedSession::read(settings.recording);
    if (!session) return tl::unexpected(std::move(session.error()));
    theatre.session_ = std::move(*session);
  } else if (with_camera) {
    auto simulation =
        Simulation::create(settings.heart, threaded_for(std::max(1U, std::thread::hardware_concurrency())));
    if (!simulation) return tl::unexpected(std::move(simulation.error()));
    theatre.simulation_.emplace(std::move(*simulation));
    theatre.session_ = PlayedSession::of(*theatre.simulation_, settings.noise);
  }
  return theatre;
}

Expected<void> Theatre::write_setup(const std::filesystem::path& folder) const {
  const std::string toml =
      simulated_configuration(*simulation_, settings_.noise) + "\n[camera]\ncalibration = \"camera.yaml\"\n";
  return write_text_file(folder / "camera.yaml", simulation_->lens().opencv_yaml()).and_then([&] {
    return write_text_file(folder / "scene.toml", toml);
  });
}

PoseTrack Theatre::poses() const {
  constexpr double kPoseRate_hz = 60.0;
  return session_ ? session_->poses(start_) : PoseTrack::swaying(start_, kPoseRate_hz);
}

Expected<EcgDeviceSignals> Theatre::ecg_device() const {
  auto signals = session_ ? Expected<EcgDeviceSignals>(session_->ecg_device(start_)) : simulated_ecg();
  // Turned over and smaller, and its R wave peaks later.
  if (signals && settings_.second_lead && !signals->second_mV) {
    signals->second_mV = signals->ecg_mV.seen_elsewhere(-0.6F, std::chrono::milliseconds(12));
  }
  return signals;
}

Expected<EcgDeviceSignals> Theatre::simulated_ecg() const {
  auto ecg = SampledWaveform::ecg_of_record(settings_.heart.ecg_record, start_);
  if (!ecg) return tl::unexpected(std::move(ecg.error()));
  EcgDeviceSignals signals{std::move(*ecg)};
  if (settings_.breath) signals.respiration = SampledWaveform::breathing(*settings_.breath, start_);
  return signals;
}

Expected<std::unique_ptr<PlayedFrames>> Theatre::frames() const {
  if (simulation_) return std::make_unique<SimulatedFrames>(*simulation_);
  return RecordedFrames::open(settings_.recording).map([](RecordedFrames frames) -> std::unique_ptr<PlayedFrames> {
    return std::make_unique<RecordedFrames>(std::move(frames));
  });
}

// A recorded pointer is in the third port, where the example of the guide has it, a second sensor in the fourth, and an
// instrument where its name says.
Expected<NdiEmulatorSettings> Theatre::ndi_settings() const {
  constexpr std::uint16_t kPointerPort = 0x0C;
  constexpr std::uint16_t kSecondSensorPort = 0x0D;
  constexpr std::string_view kInstrument = "instrument/";
  NdiEmulatorSettings ndi = settings_.ndi;
  for (const EmulatedTool& tool : settings_.tools) {
    const auto handle = port_handle_of(tool.name);
    if (!handle) return tl::unexpected(handle.error());
    ndi.tools.insert_or_assign(*handle, track_of(tool, start_));
  }
  if (!session_) return ndi;
  for (auto& [name, track] : session_->tools(start_)) {
    Expected<std::uint16_t> handle = fail("no port");
    if (name == "pointer") handle = kPointerPort;
    if (name == "second_sensor") handle = kSecondSensorPort;
    if (name.starts_with(kInstrument)) handle = port_handle_of(name.substr(kInstrument.size()));
    if (handle) ndi.tools.try_emplace(*handle, std::move(track));  // a tool that was asked for comes first
  }
  return ndi;
}

// Recorded tools have the names of their channels: "pointer", and an instrument its own.
IgtlEmulatorSettings Theatre::igtl_settings() const {
  IgtlEmulatorSettings igtl = settings_.igtl;
  for (const EmulatedTool& tool : settings_.tools) igtl.others.emplace_back(tool.name, track_of(tool, start_));
  if (!session_) return igtl;
  for (auto& [name, track] : session_->tools(start_)) {
    const std::string own = name.substr(name.rfind('/') + 1);
    const bool asked =
        std::any_of(igtl.others.begin(), igtl.others.end(), [&](const auto& t) { return t.first == own; });
    if (!asked) igtl.others.emplace_back(own, std::move(track));
  }
  return igtl;
}

Expected<std::unique_ptr<DeviceProtocol>> Theatre::protocol_of(const EmulatedDevice& device) const {
  if (device.name == "ndi") {
    return ndi_settings().map([&](const NdiEmulatorSettings& ndi) -> std::unique_ptr<DeviceProtocol> {
      return std::make_unique<NdiEmulator>(poses(), ndi, settings_.faults);
    });
  }
  if (device.name == "igtl") return std::make_unique<IgtlEmulator>(poses(), igtl_settings(), settings_.faults);
  auto ecg = ecg_device();
  if (!ecg) return tl::unexpected(std::move(ecg.error()));
  if (device.name == "medlab") return emulate_medlab(std::move(*ecg), settings_.faults);
  if (device.name == "bitalino") return emulate_bitalino(std::move(*ecg), settings_.faults);
  if (settings_.cyton_daisy) return emulate_cyton_with_daisy(std::move(*ecg), settings_.faults);
  return emulate_cyton(std::move(*ecg), settings_.faults);
}

Expected<void> Theatre::serve(const EmulatedDevice& device, const std::function<void(const std::string&)>& told,
                              const Interrupt& interrupt) const {
  const auto ready = [&](const std::string& where) { told(fmt::format("{} at {}", device.name, where)); };
  if (!device.video_output.empty()) {
    const auto shown = frames();
    if (!shown) return tl::unexpected(shown.error());
    const auto played = emulate_camera(device.video_output, **shown, start_, settings_.faults, ready, interrupt);
    if (!played) return tl::unexpected(played.error());
    told(fmt::format(
        "camera: {} frames shown, {} of them cut; {} left out, {} found the output busy, {} not rendered in time",
        played->shown, played->faulty, played->lost, played->refused, played->too_slow));
    return {};
  }
  if (const auto* can = std::get_if<CanEndpoint>(&device.where)) {
    const auto ecg = ecg_device();
    if (!ecg) return tl::unexpected(ecg.error());
    ready(format_endpoint(device.where));
    return emulate_can_ecg(can->interface_name, *ecg, settings_.can, settings_.faults, interrupt);
  }
  const auto protocol = protocol_of(device);
  if (!protocol) return tl::unexpected(protocol.error());
  if (const auto* tcp = std::get_if<TcpEndpoint>(&device.where)) {
    return emulate_on_tcp(tcp->port, **protocol, settings_.faults, ready, interrupt);
  }
  return emulate_on_terminal(std::get<SerialEndpoint>(device.where).path, **protocol, settings_.faults, ready,
                             interrupt);
}

}  // namespace perimap

// Devices that exist in this machine alone, and the heart and scope that they see.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"
#include "drivers/ecg/can_ecg.hpp"
#include "drivers/standins/emulator/ecg_device_signals.hpp"
#include "drivers/standins/emulator/emulator_faults.hpp"
#include "drivers/standins/emulator/igtl_emulator.hpp"
#include "drivers/standins/emulator/ndi_emulator.hpp"
#include "drivers/standins/emulator/played_frames.hpp"
#include "drivers/standins/emulator/played_session.hpp"
#include "drivers/standins/simulator/simulation.hpp"
#include "drivers/standins/theatre/emulated_device.hpp"
#include "drivers/standins/theatre/emulated_tool.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

struct TheatreSettings {
  std::string recording;  // to be played, once; empty: a simulated heart and scope
  // Of that heart where a camera sees it. A scope and an ECG alone go on without an end.
  SimulationSettings heart;
  TrackerNoise noise;
  std::optional<Duration> breath;  // of a respiration channel
  bool second_lead = false;        // of a BITalino or Cyton, made of the first where the recording has none
  EmulatorFaults faults;
  NdiEmulatorSettings ndi{.wired_tools = 1};
  IgtlEmulatorSettings igtl;
  bool cyton_daisy = false;
  std::vector<EmulatedTool> tools;  // further ones of a tracker
  CanEcgSettings can;
};

class Theatre {
 public:
  // With a camera and no recording the heart is simulated, which takes a while.
  [[nodiscard]] static Expected<Theatre> create(const TheatreSettings& settings, bool with_camera);

  // What perimapd needs to know of the simulated scope: its calibration, and its place in the tracked sensor, as
  // camera.yaml and scene.toml. Only where there is a simulated camera (has_simulation()).
  [[nodiscard]] Expected<void> write_setup(const std::filesystem::path& folder) const;
  [[nodiscard]] bool has_simulation() const noexcept { return simulation_.has_value(); }

  // Before serve(): when the recording or the heart begins.
  void set_start(Instant start) noexcept { start_ = start; }

  // Until the interrupt. `told` hears where the device is once it is there, and what it came to; of any thread.
  [[nodiscard]] Expected<void> serve(const EmulatedDevice& device, const std::function<void(const std::string&)>& told,
                                     const Interrupt& interrupt) const;

 private:
  explicit Theatre(TheatreSettings settings) : settings_(std::move(settings)) {}
  [[nodiscard]] PoseTrack poses() const;
  [[nodiscard]] Expected<NdiEmulatorSettings> ndi_settings() const;
  [[nodiscard]] IgtlEmulatorSettings igtl_settings() const;
  [[nodiscard]] Expected<EcgDeviceSignals> ecg_device() const;
  [[nodiscard]] Expected<EcgDeviceSignals> simulated_ecg() const;
  [[nodiscard]] Expected<std::unique_ptr<PlayedFrames>> frames() const;
  [[nodiscard]] Expected<std::unique_ptr<DeviceProtocol>> protocol_of(const EmulatedDevice& device) const;

  TheatreSettings settings_;
  Instant start_{};
  std::optional<Simulation> simulation_;  // the heart that an emulated camera sees, where no recording is played
  std::optional<PlayedSession> session_;  // that, or the recording; none: a scope and a heart without an end
};

}  // namespace perimap

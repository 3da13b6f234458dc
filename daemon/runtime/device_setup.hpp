// From a configuration to a pipeline over devices.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <variant>
#include <vector>

#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/config/configuration.hpp"
#include "daemon/config/wrong_key.hpp"
#include "daemon/publishing/identity.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "drivers/camera/v4l2_stream.hpp"
#include "drivers/camera/video_camera.hpp"
#include "drivers/ecg/modem_line_trigger.hpp"
#include "drivers/recording/replay_reader.hpp"
#include "drivers/tracker/igtl_session.hpp"
#include "drivers/tracker/ndi_session.hpp"
#include "drivers/transport/endpoint.hpp"

namespace perimap {

struct TrackerDevice {
  Endpoint endpoint;
  std::variant<NdiSettings, IgtlSettings> settings;
  std::vector<std::string> tools = {};  // names, by ToolSample::tool (tracked_tool_names)
};

struct EcgDevice {
  Endpoint endpoint;
  EcgConfiguration settings;
  int respiration_channel = 0;  // of its inputs; 0: none
};

struct RTriggerDevice {
  ModemTriggerSettings settings;
  ModemPortOpener open = &open_modem_port;
};

struct CameraPlayback {
  ReplayReader reader;             // of the frames alone
  std::optional<Duration> offset;  // from the recording's time to ours; none: begins when it is started
};

using CameraDevice = std::variant<CameraPlayback, V4l2Settings, VideoCameraSettings>;

// Those that there are.
struct Devices {
  std::optional<TrackerDevice> tracker;
  std::optional<EcgDevice> ecg;
  std::optional<RTriggerDevice> r_trigger;
  std::optional<CameraDevice> camera;
};

struct DeviceSetup {
  Configuration configuration;
  PipelineSettings pipeline;
  Identity identity;
  Devices devices;                      // all that a map takes: of ECG and R trigger one may be missing
  std::vector<WatchedTool> tools = {};  // whose distance from the surface is told
};

// Whether the configuration names devices; otherwise it is for a replay.
[[nodiscard]] bool names_devices(const Configuration& configuration) noexcept;

// All that is wrong with the device's keys. Devices are not opened yet: they may come later.
[[nodiscard]] tl::expected<TrackerDevice, WrongKeys> tracker_device(const TrackerConfiguration& configuration);
[[nodiscard]] tl::expected<EcgDevice, WrongKeys> ecg_device(const Configuration& configuration);
[[nodiscard]] tl::expected<RTriggerDevice, WrongKeys> r_trigger_device(const EcgConfiguration& configuration);
// Of `device`, or of `playback` and its start. The frames' size is that of the keys or of the calibration, or any.
[[nodiscard]] tl::expected<CameraDevice, WrongKeys> camera_device(const CameraConfiguration& configuration,
                                                                  const std::filesystem::path& configuration_file);
// Those that the configuration names, or all that is wrong with any of them.
[[nodiscard]] tl::expected<Devices, WrongKeys> named_devices(const Configuration& configuration,
                                                             const std::filesystem::path& configuration_file);
// `given`: the file as loaded by itself.
[[nodiscard]] tl::expected<DeviceSetup, SetupError> prepare_devices(const std::filesystem::path& configuration_file,
                                                                    const Configuration& given);

}  // namespace perimap

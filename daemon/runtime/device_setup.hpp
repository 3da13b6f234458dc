// From a configuration to a pipeline over devices.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>

#include "core/error/expected.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/config/configuration.hpp"
#include "daemon/publishing/identity.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "drivers/recording/replay_reader.hpp"
#include "drivers/tracker/igtl_session.hpp"
#include "drivers/tracker/ndi_session.hpp"
#include "drivers/transport/endpoint.hpp"

namespace perimap {

struct TrackerDevice {
  Endpoint endpoint;
  std::variant<NdiSettings, IgtlSettings> settings;
};

struct EcgDevice {
  Endpoint endpoint;
  EcgConfiguration settings;
};

struct CameraPlayback {
  ReplayReader reader;             // of the frames alone
  std::optional<Duration> offset;  // from the recording's time to ours; none: begins when it is started
};

struct DeviceSetup {
  Configuration configuration;
  PipelineSettings pipeline;
  Identity identity;
  TrackerDevice tracker;
  EcgDevice ecg;
  CameraPlayback camera;
};

// Whether the configuration names devices; otherwise it is for a replay.
[[nodiscard]] bool names_devices(const Configuration& configuration) noexcept;

// Errors name the key and what it should be. Devices are not opened yet: they may come later.
[[nodiscard]] Expected<TrackerDevice> tracker_device(const TrackerConfiguration& configuration);
[[nodiscard]] Expected<EcgDevice> ecg_device(const EcgConfiguration& configuration);
// `given`: the file as loaded by itself.
[[nodiscard]] tl::expected<DeviceSetup, SetupError> prepare_devices(const std::filesystem::path& configuration_file,
                                                                    const Configuration& given);

}  // namespace perimap

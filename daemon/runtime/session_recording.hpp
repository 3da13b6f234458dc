// What a recording of a live session says of itself, and where it goes.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "core/geometry/camera_model.hpp"
#include "daemon/config/configuration.hpp"
#include "drivers/recording/sensor_writer.hpp"

namespace perimap {

// FOLDER/perimap-20261121-234501.mcap, UTC; with -2, -3 and so on where that is there already.
[[nodiscard]] std::filesystem::path recording_path(const std::filesystem::path& folder,
                                                   std::chrono::system_clock::time_point now);

// The calibration goes along, and of the configuration what describes the session (session_toml): without the devices,
// and without what their drivers have applied to the samples already (the registration, the camera's delay).
[[nodiscard]] SensorRecordingFacts recording_facts(const Configuration& configuration,
                                                   const std::optional<CameraModel>& camera, std::string generator);

}  // namespace perimap

// Whether the calibrations that a configuration names were made for what it names beside them, and how old they are.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/config/configuration.hpp"

namespace perimap {

// A hand-eye of another sensor, or a tip of another tool, than the configuration has, or a tip that cannot be read: one
// line that names the key or file and says what to do. What does not say what it is of fits; where a hand-eye says so,
// the sensor must be named.
[[nodiscard]] Expected<void> calibrations_fit(const Configuration& configuration);

// Whether the frames of a video or recording that the configuration plays are as large as those that its calibration is
// for. Of a camera only the camera can tell. `configuration_file`: names of videos start at its folder.
[[nodiscard]] Expected<void> frames_fit(const Configuration& configuration,
                                        const std::filesystem::path& configuration_file);

// One line for each that is older than setup.maximum_age_days, or of a day to come.
[[nodiscard]] std::vector<std::string> old_calibrations(const Configuration& configuration,
                                                        std::chrono::system_clock::time_point now);

}  // namespace perimap

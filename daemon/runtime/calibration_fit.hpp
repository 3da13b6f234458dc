// Whether the calibrations that a configuration names were made for what it names beside them, and how old they are.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "daemon/config/configuration.hpp"
#include "daemon/config/wrong_key.hpp"

namespace perimap {

// A hand-eye or turned scope of another sensor, a tip of another tool, or a lens or turned scope for pictures of
// another size than the configuration says, or one that cannot be read: each with what to do. What does not say what it
// is of fits; where a hand-eye or scope says so, the tracker's sensor must be named. Whether devices are named or not.
[[nodiscard]] WrongKeys wrong_calibrations(const Configuration& configuration);

// Where the frames of a video or recording that the configuration plays are not as large as those that its calibration
// and its turned scope are for. Of a camera only the camera can tell. `configuration_file`: names of videos start at
// its folder.
[[nodiscard]] WrongKeys wrong_frames(const Configuration& configuration,
                                     const std::filesystem::path& configuration_file);

// One line for each that is older than setup.maximum_age_days, or of a day to come.
[[nodiscard]] std::vector<std::string> old_calibrations(const Configuration& configuration,
                                                        std::chrono::system_clock::time_point now);

}  // namespace perimap

// What a sound configuration says of the set-up that is hardly meant: defaults with real devices, what is for
// trials alone, an odd lens.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/geometry/camera_model.hpp"
#include "daemon/config/configuration.hpp"

namespace perimap {

// One line each, which names the key and says what to do. `camera`: the calibration, where one is named. Nothing is
// said of a configuration without devices, for a recording brings its own set-up.
[[nodiscard]] std::vector<std::string> setup_warnings(const Configuration& configuration,
                                                      const std::optional<CameraModel>& camera);

// Of the calibration that the configuration names, and of what is older than it may be; none of a calibration when it
// names none, or it can not be read.
[[nodiscard]] std::vector<std::string> setup_warnings(const Configuration& configuration);

}  // namespace perimap

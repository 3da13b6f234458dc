// The turned scope that a configuration names.
#pragma once

#include <optional>

#include "core/calibration/turned_scope.hpp"
#include "core/error/expected.hpp"
#include "core/geometry/camera_model.hpp"
#include "daemon/config/configuration.hpp"

namespace perimap {

// None where camera.turned_scope names no file. Fails when it cannot be read, or is of pictures of another size than
// the camera's calibration, and says what to do.
[[nodiscard]] Expected<std::optional<TurnedScope>> configured_scope(const Configuration& configuration,
                                                                    const CameraModel& camera);

}  // namespace perimap

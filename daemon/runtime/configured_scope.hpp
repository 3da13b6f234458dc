// The turned scope that a configuration names.
#pragma once

#include <optional>
#include <tl/expected.hpp>

#include "core/calibration/turned_scope.hpp"
#include "core/geometry/camera_model.hpp"
#include "daemon/config/configuration.hpp"
#include "daemon/config/wrong_key.hpp"

namespace perimap {

// None where camera.turned_scope names no file. Fails when it cannot be read, or is of pictures of another size than
// the camera's calibration, and says what to do.
[[nodiscard]] tl::expected<std::optional<TurnedScope>, WrongKeys> configured_scope(const Configuration& configuration,
                                                                                   const CameraModel& camera);

}  // namespace perimap

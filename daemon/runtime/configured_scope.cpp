#include "daemon/runtime/configured_scope.hpp"

#include <fmt/format.h>

#include "drivers/calibration/turned_scope_file.hpp"

namespace perimap {

Expected<std::optional<TurnedScope>> configured_scope(const Configuration& configuration, const CameraModel& camera) {
  if (!configuration.camera.turned_scope) return std::nullopt;
  auto scope = read_turned_scope(*configuration.camera.turned_scope);
  if (!scope) return tl::unexpected(scope.error());
  if (scope->width != camera.width || scope->height != camera.height) {
    return fail(fmt::format(
        "key 'camera.turned_scope': expected one of pictures of {}x{}, as the camera's calibration has, got one of "
        "{}x{}: measure it with `perimap calibrate scope` as the camera is used",
        camera.width, camera.height, scope->width, scope->height));
  }
  return *scope;
}

}  // namespace perimap

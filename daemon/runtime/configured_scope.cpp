#include "daemon/runtime/configured_scope.hpp"

#include <fmt/format.h>

#include <string>
#include <utility>

#include "drivers/calibration/turned_scope_file.hpp"

namespace perimap {

tl::expected<std::optional<TurnedScope>, WrongKeys> configured_scope(const Configuration& configuration,
                                                                     const CameraModel& camera) {
  const auto wrong = [](std::string what) {
    return tl::unexpected(WrongKeys{{"camera.turned_scope", std::move(what)}});
  };
  if (!configuration.camera.turned_scope) return std::nullopt;
  auto scope = read_turned_scope(*configuration.camera.turned_scope);
  if (!scope) return wrong(scope.error().message);
  if (scope->width != camera.width || scope->height != camera.height) {
    return wrong(
        fmt::format("expected one of pictures of {}x{}, as the camera's calibration has, got one of "
                    "{}x{}: measure it with `perimap calibrate scope` as the camera is used",
                    camera.width, camera.height, scope->width, scope->height));
  }
  return *scope;
}

}  // namespace perimap

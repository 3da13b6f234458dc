#include "drivers/tracker/tool_reading.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {

std::optional<Pose> pose_of_device(const Vector3d& t, const double (&wxyz)[4]) noexcept {
  constexpr double kFarthest_mm = 1e4;
  constexpr double kNormTolerance = 0.05;
  double norm2 = 0.0;
  for (const double component : wxyz) norm2 += component * component;
  // Written so that a value that is not a number fails.
  if (!(std::abs(std::sqrt(norm2) - 1.0) <= kNormTolerance) || !(t.norm() <= kFarthest_mm)) return std::nullopt;
  return pose_from_wxyz(t, wxyz);
}

ToolReading in_world(const ToolReading& sensor, const ToolReading& reference, const WorldSettings& settings) noexcept {
  if (sensor.state != ToolState::kOk) return {sensor.state, {}};
  if (!settings.relative_to_reference) return {ToolState::kOk, settings.X_IW * sensor.X_TO, sensor.error_mm};
  if (reference.state != ToolState::kOk) return {reference.state, {}};
  return {ToolState::kOk, settings.X_IW * (reference.X_TO.inverse() * sensor.X_TO),
          std::hypot(sensor.error_mm, reference.error_mm)};
}

}  // namespace perimap

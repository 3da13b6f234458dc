// Viewers' unit of length is the metre.
#pragma once

#include <foxglove_view.h>

#include <array>

#include "core/geometry/pose.hpp"

namespace perimap {

inline constexpr double kMetresPerMillimetre = 1e-3;

[[nodiscard]] inline foxglove_Point3 metres(const std::array<double, 3>& p_mm) noexcept {
  return {p_mm[0] * kMetresPerMillimetre, p_mm[1] * kMetresPerMillimetre, p_mm[2] * kMetresPerMillimetre};
}
[[nodiscard]] inline foxglove_Vector3 metres(const Vector3d& v_mm) noexcept {
  return {v_mm.x() * kMetresPerMillimetre, v_mm.y() * kMetresPerMillimetre, v_mm.z() * kMetresPerMillimetre};
}

}  // namespace perimap

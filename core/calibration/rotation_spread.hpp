// How far orientations are spread, and about which axes.
#pragma once

#include <vector>

#include "core/geometry/pose.hpp"

namespace perimap {

struct RotationSpread {
  Vector3d deviation_rad = Vector3d::Zero();  // standard deviations about the principal axes, largest first
  Matrix3d axes = Matrix3d::Identity();       // columns, in the moving frame, in that order
};

// Of rotations R_WS about their mean. Zero for none.
[[nodiscard]] RotationSpread rotation_spread(const std::vector<Matrix3d>& rotations);

}  // namespace perimap

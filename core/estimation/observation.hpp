// One sighting of one feature, with all that the filter needs to use it later.
#pragma once

#include "core/geometry/pose.hpp"
#include "core/periodic/basis.hpp"

namespace perimap {

struct Observation {
  Vector2d z = Vector2d::Zero();      // what the measurement model measures: px, or rad for bearings
  Matrix2d R = Matrix2d::Identity();  // covariance of z, pose noise included; symmetric positive definite
  Basis b;                            // basis at the sighting's phase
  Pose X_CW;                          // W into the camera's frame at capture
  Basis b_deviation{};  // by how much b changes with one deviation of the phase; empty: the phase is exact
};

}  // namespace perimap

// A second tracked sensor that tells how far an angled scope is turned in its camera head.
#pragma once

#include "core/geometry/pose.hpp"

namespace perimap {

// One sensor is fast on the camera head and the other one on the scope: the second one turns in the frame S of the
// first as the scope does in the head, or the other way round.
struct SecondSensor {
  Matrix3d reference_S2 = Matrix3d::Identity();  // the second one's orientation in S where the rotation is 0
  Vector3d axis_S = Vector3d::UnitZ();           // about which that turns
  double left_over_rad = 0.0;                    // RMS of those it was made from, of what is not about the axis

  // The scope's, from -pi to pi.
  [[nodiscard]] double rotation_rad(const Matrix3d& R_S2) const noexcept;
  // How far it is from every orientation about the axis.
  [[nodiscard]] double aside_rad(const Matrix3d& R_S2) const noexcept;
};

}  // namespace perimap

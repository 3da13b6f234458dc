// The set-up of an angled scope as a function of how far it is turned in its camera head.
//
// Turning the scope carries its line of sight about the shaft's axis a (through the point q), while the camera's sensor
// stays in the head: the picture turns about its own axis by the same angle. With the tracked sensor S on the head
//   X_SC(theta) = T(a, q, theta) X_SC(0) R_z(-theta)
// (Yamaguchi et al., Computer Aided Surgery 9(5), 2004; Wu & Jaramaz, MICCAI 2008 have the same in other words). A
// scope that looks straight ahead along a does not change. With S on the scope itself T is the identity. The principal
// point goes around the picture's centre of turning.
#pragma once

#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"

namespace perimap {

// One calibration, and how far the scope was turned then, as read_field_stop() reads it.
struct SetupAtRotation {
  double rotation_rad = 0.0;
  Pose X_SC;
  Vector2d principal_px = Vector2d::Zero();
};

struct TurnedScope {
  SetupAtRotation reference;
  bool sensor_on_scope = false;
  Vector3d axis_S = Vector3d::UnitZ();  // of the shaft, in S; where the sensor is on the head
  Vector3d point_S = Vector3d::Zero();  // on that axis, next to the camera, mm
  Vector2d turn_px = Vector2d::Zero();  // about which the principal point goes
  // What is left of the set-ups that it was made from; 0 with two.
  double rotation_rms_deg = 0.0;
  double translation_rms_mm = 0.0;

  [[nodiscard]] SetupAtRotation at(double rotation_rad) const noexcept;
};

// From calibrations at two turns and more, 20 degrees apart and more. `turn_px`: of the field stop. Fails, and says
// what is missing, when they are too near to each other or do not turn as a scope does.
[[nodiscard]] Expected<TurnedScope> fit_turned_scope(const std::vector<SetupAtRotation>& setups,
                                                     const Vector2d& turn_px);

}  // namespace perimap

// A made angled scope and its lens, for tests of how its turn is told.
#pragma once

#include "core/calibration/turned_scope.hpp"
#include "core/geometry/camera_model.hpp"

namespace perimap::test {

inline CameraModel angled_lens() {
  CameraModel camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 300.0;
  camera.cx = 170.0;
  camera.cy = 118.0;
  return camera;
}

// Without what tells the turn: field stop or second sensor.
inline TurnedScope angled_scope() {
  TurnedScope scope;
  scope.reference.X_SC = {so3_exp({0.5, 0.1, 0.2}), {3.0, -4.0, 60.0}};
  scope.reference.principal_px = {170.0, 118.0};
  scope.reference.focal_px = {300.0, 300.0};
  scope.axis_S = Vector3d(0.1, 0.2, 1.0).normalized();
  scope.point_S = {2.0, -3.0, 0.0};
  scope.turn_px = {161.0, 119.0};
  return scope;
}

}  // namespace perimap::test

// Two coordinates for every place of a surface as it is seen from where the camera has been: a bearing, in mm at the
// surface's mean depth. Frame A: origin at the mean camera, z towards the surface.
//
//   q = R_WA^T (p - c),   s = d (q_x / q_z, q_y / q_z)
#pragma once

#include "core/geometry/pose.hpp"

namespace perimap {

struct SurfaceChart {
  Pose X_WA;            // t is the mean camera
  double depth_mm = 0;  // d > 0

  // A chart about `camera_W` (mm) that looks at `centre_W`, which is not the same place.
  [[nodiscard]] static SurfaceChart looking_at(const Vector3d& camera_W, const Vector3d& centre_W) noexcept;

  struct Place {
    Vector2d s = Vector2d::Zero();  // mm
    double depth_mm = 0.0;          // q_z; the place is in the chart while it is positive
  };
  [[nodiscard]] Place place_of(const Vector3d& p_W) const noexcept;
  [[nodiscard]] Vector3d point_at(const Vector2d& s, double depth_mm) const noexcept;
  // d p_W / d depth at a bearing; its length is 1 on the axis and grows with the angle from it.
  [[nodiscard]] Vector3d ray_W(const Vector2d& s) const noexcept;
};

}  // namespace perimap

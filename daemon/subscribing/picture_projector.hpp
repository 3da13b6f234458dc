// Where points of the world are in the picture that a surface's frame is.
#pragma once

#include <perimap.h>

#include <array>
#include <optional>

#include "core/geometry/camera_model.hpp"
#include "core/geometry/pose.hpp"

namespace perimap {

class PictureProjector {
 public:
  // The surface's camera pose must be known (camera_pose_known). Focal lengths and principal point are the surface's
  // own where it tells them; the rest is `lens`'s.
  PictureProjector(const perimap_Surface& surface, const CameraModel& lens);

  // mm in W to pixels; none of what the camera does not see.
  [[nodiscard]] std::optional<Vector2d> operator()(const std::array<double, 3>& p_W_mm) const;
  // As this picture was taken.
  [[nodiscard]] const CameraModel& lens() const noexcept { return lens_; }

 private:
  CameraModel lens_;
  Pose X_CW_;
};

}  // namespace perimap

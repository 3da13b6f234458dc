#include "daemon/subscribing/picture_projector.hpp"

namespace perimap {

PictureProjector::PictureProjector(const perimap_Surface& surface, const CameraModel& lens) : lens_(lens) {
  const Vector3d t(surface.translation_WC_mm[0], surface.translation_WC_mm[1], surface.translation_WC_mm[2]);
  X_CW_ = pose_from_wxyz(t, surface.rotation_WC_wxyz).inverse();
  if (surface.camera_focal_px[0] > 0 && surface.camera_focal_px[1] > 0) {
    lens_.fx = surface.camera_focal_px[0];
    lens_.fy = surface.camera_focal_px[1];
    lens_.cx = surface.camera_principal_point_px[0];
    lens_.cy = surface.camera_principal_point_px[1];
  }
}

std::optional<Vector2d> PictureProjector::operator()(const std::array<double, 3>& p_W_mm) const {
  Vector2d px;
  const Vector3d p_C = X_CW_ * Vector3d(p_W_mm[0], p_W_mm[1], p_W_mm[2]);
  if (lens_.project(p_C, px) != ProjectionStatus::kOk) return std::nullopt;
  return px;
}

}  // namespace perimap

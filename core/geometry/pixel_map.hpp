// From the pixels of a calibrated lens to those of a picture in which focal length and principal point are others:
// distortion goes along, since it is a function of the angle alone.
#pragma once

#include <Eigen/Core>

#include "core/geometry/camera_model.hpp"
#include "core/geometry/pose.hpp"

namespace perimap {

// picture = scale * lens + offset, axis by axis.
struct PixelMap {
  Vector2d scale = Vector2d::Ones();
  Vector2d offset_px = Vector2d::Zero();

  [[nodiscard]] Vector2d to_picture(const Vector2d& lens_px) const noexcept {
    return scale.cwiseProduct(lens_px) + offset_px;
  }
  [[nodiscard]] Vector2d to_lens(const Vector2d& picture_px) const noexcept {
    return (picture_px - offset_px).cwiseQuotient(scale);
  }
  [[nodiscard]] Matrix2d covariance_to_lens(const Matrix2d& picture_px2) const noexcept {
    const Vector2d inverse = scale.cwiseInverse();
    return inverse.asDiagonal() * picture_px2 * inverse.asDiagonal();
  }
};

// `focal_px`, `principal_px`: of the picture.
[[nodiscard]] inline PixelMap pixel_map(const CameraModel& lens, const Vector2d& focal_px,
                                        const Vector2d& principal_px) noexcept {
  PixelMap map;
  map.scale = focal_px.cwiseQuotient(Vector2d(lens.fx, lens.fy));
  map.offset_px = principal_px - map.scale.cwiseProduct(Vector2d(lens.cx, lens.cy));
  return map;
}

// Of one picture.
struct PictureLens {
  Vector2d focal_px = Vector2d::Zero();
  Vector2d principal_px = Vector2d::Zero();
};

[[nodiscard]] inline PictureLens lens_of(const PixelMap& picture, const CameraModel& lens) noexcept {
  return {picture.scale.cwiseProduct(Vector2d(lens.fx, lens.fy)), picture.to_picture(Vector2d(lens.cx, lens.cy))};
}

}  // namespace perimap

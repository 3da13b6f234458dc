// A calibrated camera in OpenCV's convention: pinhole with Brown-Conrady distortion (camera_matrix,
// distortion_coefficients k1 k2 p1 p2 k3; "Camera Calibration and 3D Reconstruction" of the OpenCV manual) or
// Kannala-Brandt fisheye (cv::fisheye, k1 k2 k3 k4). Pixel centres have integer coordinates.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/geometry/pose.hpp"

namespace perimap {

using Matrix23d = Eigen::Matrix<double, 2, 3>;

enum class Lens : std::uint8_t { kBrownConrady, kKannalaBrandt };

enum class ProjectionStatus : std::uint8_t {
  kOk,
  kBehindCamera,  // not in front of the projection centre; a fisheye may see there
  kFoldedBack,    // beyond the radius where the distortion polynomial turns back: no such image point exists
  kNotFinite,     // NaN or infinity came in, or the direction is undefined
};

struct CameraModel {
  int width = 0;  // px
  int height = 0;
  double fx = 0.0;  // px
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  double k1 = 0.0;  // radial
  double k2 = 0.0;
  double p1 = 0.0;  // tangential; not with a fisheye
  double p2 = 0.0;
  double k3 = 0.0;
  double k4 = 0.0;  // with a fisheye alone
  Lens lens = Lens::kBrownConrady;

  // Pixel px of a point p_C (mm, frame C) and, when asked for, d px / d p_C (2x3, px/mm). Points outside the image are
  // projected too. px and the Jacobian are only written when the status is kOk.
  [[nodiscard]] ProjectionStatus project(const Vector3d& p_C, Vector2d& px, Matrix23d* dpx_dp = nullptr) const noexcept;

  // Unit ray in C through a pixel. False when px is not finite or no ray maps there (Newton's method on the distortion
  // finds none before the fold); ray_C is then untouched.
  [[nodiscard]] bool unproject(const Vector2d& px, Vector3d& ray_C) const noexcept;

  // Whether px lies on the sensor.
  [[nodiscard]] bool contains(const Vector2d& px) const noexcept {
    return px.x() >= -0.5 && px.y() >= -0.5 && px.x() < width - 0.5 && px.y() < height - 0.5;
  }
};

}  // namespace perimap

// Kannala-Brandt fisheye distortion, in OpenCV's convention (cv::fisheye, coefficients k1 k2 k3 k4; Kannala & Brandt,
// "A generic camera model and calibration method for conventional, wide-angle, and fish-eye lenses", PAMI 28(8), 2006).
//
// A ray at the angle theta from the optical axis meets the image at theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3
// theta^6 + k4 theta^8) from the centre, in units of the focal length.
#pragma once

#include <Eigen/Core>

#include "core/geometry/pose.hpp"

namespace perimap {

struct KannalaBrandt {
  double k1 = 0.0;
  double k2 = 0.0;
  double k3 = 0.0;
  double k4 = 0.0;

  // Normalised image point m of a point q (any length unit, frame C; theta may exceed 90 degrees) and dm/dq (2x3).
  // False beyond the angle where theta_d turns back, where no such image point exists; m and dm_dq are then untouched.
  // |q| must be finite and not zero.
  [[nodiscard]] bool distort(const Vector3d& q, Vector2d& m, Eigen::Matrix<double, 2, 3>& dm_dq) const noexcept;

  // Unit ray through the normalised image point m (finite). False when there is none before theta_d turns back.
  [[nodiscard]] bool undistort(const Vector2d& m, Vector3d& ray_C) const noexcept;
};

}  // namespace perimap

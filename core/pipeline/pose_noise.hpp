// What the noise of the camera pose does to a pixel measurement.
#pragma once

#include "core/geometry/camera_model.hpp"
#include "core/pipeline/pose_history.hpp"

namespace perimap {

// Covariance (px^2) that the tracker's error adds to the pixel of p_WF. J_p = d px / d p_WF (2x3, px/mm).
// The sensor's translation error moves the point by the opposite; its rotation error dtheta turns the point about the
// sensor by -dtheta, hence by [p - s]x dtheta, where s = c - lever is the sensor and c the camera centre.
[[nodiscard]] inline Matrix2d pose_noise_covariance(const CameraPose& pose, const Vector3d& p_WF_mm,
                                                    const Matrix23d& J_p) noexcept {
  const Vector3d r = p_WF_mm - pose.X_WC.t + pose.lever_W_mm;
  const Matrix23d G = J_p * cross_matrix(r);
  return pose.position_variance_mm2 * J_p * J_p.transpose() + pose.rotation_variance_rad2 * G * G.transpose();
}

}  // namespace perimap

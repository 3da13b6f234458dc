// What the error of the camera pose does to a pixel measurement.
//
// The error s = [theta, d]: the sensor turns by theta about itself (rad) and moves by d (mm), both in frame W.
#pragma once

#include "core/estimation/correlated_pose_noise.hpp"
#include "core/estimation/measurement_model.hpp"
#include "core/pipeline/pose_history.hpp"

namespace perimap {

// d px / ds of the pixel of p_WF. J_p = d px / d p_WF (2x3, px/mm). The sensor's translation moves the point by the
// opposite; its rotation turns the point about the sensor by -theta, hence by [p - q]x theta, where q = c - lever is
// the sensor and c the camera centre.
[[nodiscard]] inline Matrix26d pose_error_jacobian(const CameraPose& pose, const Vector3d& p_WF_mm,
                                                   const Matrix23d& J_p) noexcept {
  const Vector3d r = p_WF_mm - pose.X_WC.t + pose.lever_W_mm;
  Matrix26d J_s;
  J_s << J_p * cross_matrix(r), -J_p;
  return J_s;
}

[[nodiscard]] inline Matrix6d pose_error_covariance(const CameraPose& pose) noexcept {
  Eigen::Matrix<double, 6, 1> variances;
  variances << Vector3d::Constant(pose.rotation_variance_rad2), Vector3d::Constant(pose.position_variance_mm2);
  return variances.asDiagonal();
}

// Covariance (px^2) that the tracker's error adds to the pixel of p_WF.
[[nodiscard]] inline Matrix2d pose_noise_covariance(const CameraPose& pose, const Vector3d& p_WF_mm,
                                                    const Matrix23d& J_p) noexcept {
  const Matrix26d J_s = pose_error_jacobian(pose, p_WF_mm, J_p);
  const Matrix23d G = J_s.leftCols<3>();
  return pose.position_variance_mm2 * J_p * J_p.transpose() + pose.rotation_variance_rad2 * G * G.transpose();
}

// Of its error's part that lasts.
[[nodiscard]] inline Matrix6d lasting_error_covariance(const CameraPose& pose) noexcept {
  CameraPose lasting = pose;
  lasting.position_variance_mm2 -= pose.own_position_variance_mm2;
  lasting.rotation_variance_rad2 -= pose.own_rotation_variance_rad2;
  return pose_error_covariance(lasting);
}

// What a term has from the pose and from where the feature is: dz_dp, dz_ds, sigma. False where it can not be seen.
[[nodiscard]] inline bool describe_pose_noise(const PixelModel& model, const Pose& X_CW, const CameraPose& pose,
                                              const Vector3d& p_WF_mm, PoseNoiseTerm& term) noexcept {
  Vector2d px;
  Matrix23d J_C;
  if (model.camera.project(X_CW * p_WF_mm, px, &J_C) != ProjectionStatus::kOk) return false;
  term.dz_dp = J_C * X_CW.R;
  term.dz_ds = pose_error_jacobian(pose, p_WF_mm, term.dz_dp);
  term.sigma = lasting_error_covariance(pose);
  return true;
}

}  // namespace perimap

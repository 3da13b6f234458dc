// What a camera measures of a point, as the filter needs it: prediction z = h(q), q = p_CF, its Jacobian, the
// residual's arithmetic, and the way back from z to a ray. Two models with one interface:
//
//   PixelModel    z = pixel (px); frame C as everywhere (x right, y down, z forward)
//   BearingModel  z = [azimuth, elevation] (rad), Tully, Kantor & Choset (2013), Eq. 1. Its camera frame is x forward,
//   y
//                 left, z up, so "X_CW" of its observations leads into that frame. Sees all directions, behind
//                 included.
#pragma once

#include <Eigen/Core>

#include "core/geometry/camera_model.hpp"
#include "core/geometry/pose.hpp"

namespace perimap {

struct PixelModel {
  CameraModel camera;

  // z (px) at q (mm, frame C) and, when asked for, dz/dq (2x3). Neither is written unless the status is kOk.
  [[nodiscard]] ProjectionStatus predict(const Vector3d& q, Vector2d& z, Matrix23d* dz_dq = nullptr) const noexcept {
    return camera.project(q, z, dz_dq);
  }
  [[nodiscard]] Vector2d residual(const Vector2d& z, const Vector2d& z_predicted) const noexcept {
    return z - z_predicted;
  }
  // Unit ray in C; false when no ray gives z.
  [[nodiscard]] bool ray(const Vector2d& z, Vector3d& ray_C) const noexcept { return camera.unproject(z, ray_C); }
};

struct BearingModel {
  // z = [atan2(q_y, q_x), atan2(q_z, hypot(q_x, q_y))]. On the vertical axis the azimuth is undefined: kNotFinite.
  [[nodiscard]] ProjectionStatus predict(const Vector3d& q, Vector2d& z, Matrix23d* dz_dq = nullptr) const noexcept;
  // Both components wrapped to [-pi, pi).
  [[nodiscard]] Vector2d residual(const Vector2d& z, const Vector2d& z_predicted) const noexcept;
  [[nodiscard]] bool ray(const Vector2d& z, Vector3d& ray_C) const noexcept;
};

struct MeasurementJacobians {
  Matrix23d dz_dp;      // with respect to the feature p_WF (per mm, frame W)
  Matrix23d dz_dc;      // with respect to the camera's centre c = p_WC (per mm, frame W); equals -dz_dp
  Matrix23d dz_dtheta;  // with respect to a left perturbation of the rotation, R_CW <- exp([theta]x) R_CW (per rad,
                        // frame C, centre held)
};

// z and its Jacobians for a feature at p_WF seen from X_CW. Nothing is written unless the status is kOk.
template <class Model>
[[nodiscard]] ProjectionStatus measure(const Model& model, const Pose& X_CW, const Vector3d& p_WF, Vector2d& z,
                                       MeasurementJacobians* jacobians = nullptr) noexcept;

// What a white error of the pose adds to the measurement's covariance: J_c S_c J_c^T + J_theta S_theta J_theta^T.
// sigma_c: covariance of the camera's centre (mm^2, frame W); sigma_theta: of the rotation (rad^2, frame C).
[[nodiscard]] Matrix2d pose_noise_covariance(const MeasurementJacobians& jacobians, const Matrix3d& sigma_c,
                                             const Matrix3d& sigma_theta) noexcept;

extern template ProjectionStatus measure(const PixelModel&, const Pose&, const Vector3d&, Vector2d&,
                                         MeasurementJacobians*) noexcept;
extern template ProjectionStatus measure(const BearingModel&, const Pose&, const Vector3d&, Vector2d&,
                                         MeasurementJacobians*) noexcept;

}  // namespace perimap

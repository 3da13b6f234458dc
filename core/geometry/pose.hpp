// Rigid poses. X_AB maps coordinates in frame B to coordinates in frame A: p_A = X_AB * p_B, and X_AC = X_AB * X_BC.
//
// Frames of the project, one letter each:
//   W  world: the tracker's own frame, or the patient reference tool's when one is configured
//   S  the tracked sensor on the scope
//   C  camera: x right, y down, z forward along the optical axis, origin at the projection centre
//   F  a feature (a point: p_WF is its position in W)
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace perimap {

using Vector2d = Eigen::Vector2d;
using Vector3d = Eigen::Vector3d;
using Matrix2d = Eigen::Matrix2d;
using Matrix3d = Eigen::Matrix3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;

// Invariant: R is a rotation (orthonormal, determinant +1) to rounding. Length unit: mm.
struct Pose {
  Matrix3d R = Matrix3d::Identity();
  Vector3d t = Vector3d::Zero();

  [[nodiscard]] Vector3d operator*(const Vector3d& p) const noexcept { return R * p + t; }
  [[nodiscard]] Pose operator*(const Pose& X) const noexcept { return {R * X.R, R * X.t + t}; }
  [[nodiscard]] Pose inverse() const noexcept { return {R.transpose(), -(R.transpose() * t)}; }
};

// [v]x, so that cross_matrix(v) * u = v x u.
[[nodiscard]] Matrix3d cross_matrix(const Vector3d& v) noexcept;

// so(3): rotation by |w| rad about w (Rodrigues), with the series at small angles, and its inverse with |w| <= pi.
[[nodiscard]] Matrix3d so3_exp(const Vector3d& w) noexcept;
[[nodiscard]] Vector3d so3_log(const Matrix3d& R) noexcept;

// From a unit quaternion in order w x y z; normalises. The zero quaternion is the caller's error to exclude.
[[nodiscard]] Pose pose_from_wxyz(const Vector3d& t, const double (&wxyz)[4]) noexcept;
void rotation_to_wxyz(const Matrix3d& R, double (&wxyz)[4]) noexcept;

// Between X_0 (s = 0) and X_1 (s = 1): constant angular velocity, translation linear. s outside [0, 1] extrapolates.
[[nodiscard]] Pose interpolate(const Pose& X_0, const Pose& X_1, double s) noexcept;

}  // namespace perimap

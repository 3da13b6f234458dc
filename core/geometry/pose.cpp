#include "core/geometry/pose.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {

Matrix3d cross_matrix(const Vector3d& v) noexcept {
  Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Matrix3d so3_exp(const Vector3d& w) noexcept {
  const double angle2 = w.squaredNorm();
  const double angle = std::sqrt(angle2);
  double a = 0.0;  // sin(angle) / angle
  double b = 0.0;  // (1 - cos(angle)) / angle^2
  if (angle2 < 1e-8) {
    a = 1.0 - angle2 / 6.0;
    b = 0.5 - angle2 / 24.0;
  } else {
    a = std::sin(angle) / angle;
    const double half_sine = std::sin(0.5 * angle);
    b = 2.0 * half_sine * half_sine / angle2;
  }
  const Matrix3d W = cross_matrix(w);
  return Matrix3d::Identity() + a * W + b * W * W;
}

Vector3d so3_log(const Matrix3d& R) noexcept {
  // Through the quaternion: well conditioned at every angle, pi included.
  Eigen::Quaterniond q(R);
  q.normalize();
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  const double scale = sine < 1e-9 ? 2.0 / q.w() : 2.0 * std::atan2(sine, q.w()) / sine;
  return scale * q.vec();
}

Pose pose_from_wxyz(const Vector3d& t, const double (&wxyz)[4]) noexcept {
  Eigen::Quaterniond q(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  q.normalize();
  return {q.toRotationMatrix(), t};
}

void rotation_to_wxyz(const Matrix3d& R, double (&wxyz)[4]) noexcept {
  Eigen::Quaterniond q(R);
  q.normalize();
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  wxyz[0] = q.w();
  wxyz[1] = q.x();
  wxyz[2] = q.y();
  wxyz[3] = q.z();
}

Pose interpolate(const Pose& X_0, const Pose& X_1, double s) noexcept {
  const Vector3d w = so3_log(X_0.R.transpose() * X_1.R);
  return {X_0.R * so3_exp(s * w), (1.0 - s) * X_0.t + s * X_1.t};
}

}  // namespace perimap

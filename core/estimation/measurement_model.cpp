#include "core/estimation/measurement_model.hpp"

#include <cmath>
#include <numbers>

namespace perimap {
namespace {

double wrap_to_pi(double angle) noexcept {
  const double wrapped = std::remainder(angle, 2.0 * std::numbers::pi);
  return wrapped >= std::numbers::pi ? -std::numbers::pi : wrapped;
}

}  // namespace

ProjectionStatus BearingModel::predict(const Vector3d& q, Vector2d& z, Matrix23d* dz_dq) const noexcept {
  const double rho = std::hypot(q.x(), q.y());
  const double rho2 = rho * rho;
  const double range2 = rho2 + q.z() * q.z();
  // Also no direction at the camera's centre itself.
  if (!std::isfinite(range2) || rho2 < 1e-12 * range2 || range2 < 1e-24) return ProjectionStatus::kNotFinite;
  z << std::atan2(q.y(), q.x()), std::atan2(q.z(), rho);
  if (dz_dq != nullptr) {
    const double scale = q.z() / (rho * range2);
    *dz_dq << -q.y() / rho2, q.x() / rho2, 0.0,  //
        -q.x() * scale, -q.y() * scale, rho / range2;
  }
  return ProjectionStatus::kOk;
}

Vector2d BearingModel::residual(const Vector2d& z, const Vector2d& z_predicted) const noexcept {
  return {wrap_to_pi(z.x() - z_predicted.x()), wrap_to_pi(z.y() - z_predicted.y())};
}

bool BearingModel::ray(const Vector2d& z, Vector3d& ray_C) const noexcept {
  if (!z.allFinite()) return false;
  const double horizontal = std::cos(z.y());
  ray_C = Vector3d(horizontal * std::cos(z.x()), horizontal * std::sin(z.x()), std::sin(z.y()));
  return true;
}

template <class Model>
ProjectionStatus measure(const Model& model, const Pose& X_CW, const Vector3d& p_WF, Vector2d& z,
                         MeasurementJacobians* jacobians) noexcept {
  const Vector3d q = X_CW * p_WF;
  if (jacobians == nullptr) return model.predict(q, z);
  Matrix23d dz_dq;
  const ProjectionStatus status = model.predict(q, z, &dz_dq);
  if (status != ProjectionStatus::kOk) return status;
  jacobians->dz_dp.noalias() = dz_dq * X_CW.R;
  jacobians->dz_dc = -jacobians->dz_dp;
  // d(exp([theta]x) q)/dtheta = -[q]x; row i of dz_dq times -[q]x is q x row_i.
  for (int i = 0; i < 2; ++i) {
    const Vector3d row = dz_dq.row(i).transpose();
    jacobians->dz_dtheta.row(i) = q.cross(row).transpose();
  }
  return status;
}

Matrix2d pose_noise_covariance(const MeasurementJacobians& jacobians, const Matrix3d& sigma_c,
                               const Matrix3d& sigma_theta) noexcept {
  Matrix2d R = jacobians.dz_dc * sigma_c * jacobians.dz_dc.transpose() +
               jacobians.dz_dtheta * sigma_theta * jacobians.dz_dtheta.transpose();
  R(0, 1) = R(1, 0) = 0.5 * (R(0, 1) + R(1, 0));
  return R;
}

template ProjectionStatus measure(const PixelModel&, const Pose&, const Vector3d&, Vector2d&,
                                  MeasurementJacobians*) noexcept;
template ProjectionStatus measure(const BearingModel&, const Pose&, const Vector3d&, Vector2d&,
                                  MeasurementJacobians*) noexcept;

}  // namespace perimap

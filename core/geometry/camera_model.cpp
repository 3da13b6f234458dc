#include "core/geometry/camera_model.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/kannala_brandt.hpp"

namespace perimap {
namespace {

// Nearer than this a point counts as behind the camera (mm).
constexpr double kMinDepth = 1e-3;

// Distorted normalised image coordinates and their Jacobian with respect to the undistorted ones.
struct Distorted {
  Vector2d m;
  Matrix2d J;
};

Distorted distort(const CameraModel& camera, double x, double y) noexcept {
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (camera.k1 + r2 * (camera.k2 + r2 * camera.k3));
  const double slope = camera.k1 + r2 * (2.0 * camera.k2 + r2 * 3.0 * camera.k3);  // d radial / d r2
  const double p1 = camera.p1;
  const double p2 = camera.p2;
  Distorted d;
  d.m << x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
      y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
  const double off_diagonal = 2.0 * (x * y * slope + p1 * x + p2 * y);
  d.J << radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x, off_diagonal, off_diagonal,
      radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x;
  return d;
}

// Whether the distorted radius grows all the way out to r2, that is, d(r radial)/dr = 1 + 3 k1 r2 + 5 k2 r2^2 + 7 k3
// r2^3 is positive on [0, r2]. The sign at r2 alone does not tell: the polynomial may fold and unfold again.
bool grows_up_to(const CameraModel& camera, double r2) noexcept {
  const double g1 = 3.0 * camera.k1;
  const double g2 = 5.0 * camera.k2;
  const double g3 = 7.0 * camera.k3;
  const auto growth = [&](double u) { return 1.0 + u * (g1 + u * (g2 + u * g3)); };
  const double lower_bound = 1.0 + r2 * (std::min(g1, 0.0) + r2 * (std::min(g2, 0.0) + r2 * std::min(g3, 0.0)));
  if (lower_bound > 0.0) return true;
  if (growth(r2) <= 0.0) return false;
  // Extrema inside: the roots of g1 + 2 g2 u + 3 g3 u^2, in a form that also serves g3 = 0.
  const double discriminant = g2 * g2 - 3.0 * g1 * g3;
  if (discriminant < 0.0) return true;
  const double q = -(g2 + std::copysign(std::sqrt(discriminant), g2));
  for (const double u : {g1 / q, q / (3.0 * g3)}) {
    if (u > 0.0 && u < r2 && growth(u) <= 0.0) return false;
  }
  return true;
}

bool folded_back(const CameraModel& camera, double r2, const Matrix2d& J) noexcept {
  return !(J.determinant() > 0.0) || !grows_up_to(camera, r2);
}

KannalaBrandt fisheye_of(const CameraModel& camera) noexcept { return {camera.k1, camera.k2, camera.k3, camera.k4}; }

}  // namespace

ProjectionStatus CameraModel::project(const Vector3d& p_C, Vector2d& px, Matrix23d* dpx_dp) const noexcept {
  if (!p_C.allFinite()) return ProjectionStatus::kNotFinite;
  if (lens == Lens::kKannalaBrandt) {
    if (p_C.norm() < kMinDepth) return ProjectionStatus::kBehindCamera;
    Vector2d m;
    Matrix23d dm_dp;
    if (!fisheye_of(*this).distort(p_C, m, dm_dp)) return ProjectionStatus::kFoldedBack;
    px << fx * m.x() + cx, fy * m.y() + cy;
    if (dpx_dp != nullptr) *dpx_dp << fx * dm_dp.row(0), fy * dm_dp.row(1);
    return ProjectionStatus::kOk;
  }
  if (p_C.z() < kMinDepth) return ProjectionStatus::kBehindCamera;
  const double inverse_depth = 1.0 / p_C.z();
  const double x = p_C.x() * inverse_depth;
  const double y = p_C.y() * inverse_depth;
  const Distorted d = distort(*this, x, y);
  if (!d.m.allFinite()) return ProjectionStatus::kNotFinite;
  if (folded_back(*this, x * x + y * y, d.J)) return ProjectionStatus::kFoldedBack;
  px << fx * d.m.x() + cx, fy * d.m.y() + cy;
  if (dpx_dp != nullptr) {
    const double gx = fx * inverse_depth;
    const double gy = fy * inverse_depth;
    *dpx_dp << gx * d.J(0, 0), gx * d.J(0, 1), -gx * (d.J(0, 0) * x + d.J(0, 1) * y),  //
        gy * d.J(1, 0), gy * d.J(1, 1), -gy * (d.J(1, 0) * x + d.J(1, 1) * y);
  }
  return ProjectionStatus::kOk;
}

bool CameraModel::unproject(const Vector2d& px, Vector3d& ray_C) const noexcept {
  const Vector2d target((px.x() - cx) / fx, (px.y() - cy) / fy);
  if (!target.allFinite()) return false;
  if (lens == Lens::kKannalaBrandt) return fisheye_of(*this).undistort(target, ray_C);
  // The centre is never folded, and from there a damped Newton iteration that keeps to the unfolded side and always
  // comes nearer reaches the one solution there, when there is one.
  constexpr int kMaxIterations = 50;
  const double tolerance = 1e-14 * (1.0 + target.norm());
  Vector2d m = Vector2d::Zero();
  Distorted d = distort(*this, 0.0, 0.0);
  double error = (target - d.m).norm();
  for (int i = 0; i < kMaxIterations && error > tolerance; ++i) {
    const Vector2d step = d.J.inverse() * (target - d.m);
    bool nearer = false;
    for (int halvings = 0; halvings < 20 && !nearer; ++halvings) {
      const Vector2d trial = m + std::ldexp(1.0, -halvings) * step;
      const Distorted d_trial = distort(*this, trial.x(), trial.y());
      const double trial_error = (target - d_trial.m).norm();
      nearer = trial_error < error && !folded_back(*this, trial.squaredNorm(), d_trial.J);
      if (nearer) {
        m = trial;
        d = d_trial;
        error = trial_error;
      }
    }
    if (!nearer) break;
  }
  // Rounding may stop the descent a little above the tolerance; 1e-10 is 1e-7 px at most.
  if (!(error < 1e-10 * (1.0 + target.norm()))) return false;
  ray_C = Vector3d(m.x(), m.y(), 1.0).normalized();
  return true;
}

}  // namespace perimap

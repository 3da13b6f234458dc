#include "core/surface/surface_chart.hpp"

namespace perimap {

SurfaceChart SurfaceChart::looking_at(const Vector3d& camera_W, const Vector3d& centre_W) noexcept {
  SurfaceChart chart;
  const Vector3d axis = centre_W - camera_W;
  chart.depth_mm = axis.norm();
  chart.X_WA.t = camera_W;
  chart.X_WA.R.col(2) = axis / chart.depth_mm;
  chart.X_WA.R.col(0) = chart.X_WA.R.col(2).unitOrthogonal();
  chart.X_WA.R.col(1) = chart.X_WA.R.col(2).cross(chart.X_WA.R.col(0));
  return chart;
}

SurfaceChart::Place SurfaceChart::place_of(const Vector3d& p_W) const noexcept {
  const Vector3d q = X_WA.R.transpose() * (p_W - X_WA.t);
  return {depth_mm / q.z() * q.head<2>(), q.z()};
}

Vector3d SurfaceChart::point_at(const Vector2d& s, double depth) const noexcept { return X_WA.t + depth * ray_W(s); }

Vector3d SurfaceChart::ray_W(const Vector2d& s) const noexcept {
  return X_WA.R * Vector3d(s.x() / depth_mm, s.y() / depth_mm, 1.0);
}

}  // namespace perimap

#include "drivers/standins/truth/surface_view.hpp"

namespace perimap {

SurfaceView::SurfaceView(std::span<const Vector3d> p_C, std::span<const std::uint32_t> triangles) {
  triangles_.reserve(triangles.size() / 3);
  for (std::size_t i = 0; i + 2 < triangles.size(); i += 3) {
    triangles_.emplace_back(p_C[triangles[i]], p_C[triangles[i + 1]], p_C[triangles[i + 2]]);
  }
}

std::optional<SurfacePoint> SurfaceView::first_hit(const Vector3d& ray_C) const noexcept {
  std::optional<SurfacePoint> hit;
  double nearest = 0.0;  // largest sum(w) = 1 / z so far
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const TriangleRays& rays = triangles_[i];
    if (!rays.valid) continue;
    const Vector3d w = rays.inverse * ray_C;
    const double sum = w.sum();
    // A ray through an edge must meet one of the two triangles, whatever the rounding.
    if (sum <= nearest || w.minCoeff() < -1e-9 * sum) continue;
    nearest = sum;
    const Vector3d weights = w.cwiseMax(0.0) / w.cwiseMax(0.0).sum();
    hit = SurfacePoint{static_cast<std::uint32_t>(i), {weights[0], weights[1], weights[2]}};
  }
  return hit;
}

}  // namespace perimap

#include "drivers/simulator/ground_truth.hpp"

#include <algorithm>

#include "drivers/simulator/triangle_rays.hpp"

namespace perimap {

Expected<GroundTruth> GroundTruth::create(HeartMesh mesh_W, HeartMotion motion, std::vector<CameraTruth> cameras) {
  if (const auto good = check(mesh_W); !good) return tl::unexpected(good.error());
  if (const auto good = check(motion); !good) return tl::unexpected(good.error());
  std::sort(cameras.begin(), cameras.end(),
            [](const CameraTruth& a, const CameraTruth& b) { return a.capture < b.capture; });
  return GroundTruth(std::move(mesh_W), std::move(motion), std::move(cameras));
}

std::optional<Pose> GroundTruth::camera_pose(Instant capture) const noexcept {
  const auto found =
      std::lower_bound(cameras_.begin(), cameras_.end(), capture,
                       [](const CameraTruth& camera, Instant instant) { return camera.capture < instant; });
  if (found == cameras_.end() || found->capture != capture) return std::nullopt;
  return found->X_WC;
}

void GroundTruth::vertices_at(Instant t, std::span<Vector3d> out) const {
  const auto basis = fourier_basis(phase(t).phase_rad, mesh_.harmonics);
  vertex_positions(mesh_, basis, out);
  const Vector3d breathing = respiration_displacement(motion_, t);
  for (Vector3d& p : out) p += breathing;
}

std::optional<SurfacePoint> GroundTruth::first_hit(const Pose& X_WC, const Vector3d& ray_C, Instant t) const {
  std::vector<Vector3d> p_C(mesh_.vertex_count);
  vertices_at(t, p_C);
  const Pose X_CW = X_WC.inverse();
  for (Vector3d& p : p_C) p = X_CW * p;

  std::optional<SurfacePoint> hit;
  double nearest = 0.0;  // largest sum(w) = 1 / z so far
  for (std::uint32_t triangle = 0; triangle < mesh_.triangle_count(); ++triangle) {
    const std::uint32_t* corners = mesh_.triangles.data() + 3 * std::size_t{triangle};
    const TriangleRays rays(p_C[corners[0]], p_C[corners[1]], p_C[corners[2]]);
    if (!rays.valid) continue;
    const Vector3d w = rays.inverse * ray_C;
    const double sum = w.sum();
    // A ray through an edge must meet one of the two triangles, whatever the rounding.
    if (sum <= nearest || w.minCoeff() < -1e-9 * sum) continue;
    nearest = sum;
    const Vector3d weights = w.cwiseMax(0.0) / w.cwiseMax(0.0).sum();
    hit = SurfacePoint{triangle, {weights[0], weights[1], weights[2]}};
  }
  return hit;
}

Vector3d GroundTruth::position(const SurfacePoint& point, Instant t) const {
  const auto basis = fourier_basis(phase(t).phase_rad, mesh_.harmonics);
  Vector3d p = respiration_displacement(motion_, t);
  for (std::size_t corner = 0; corner < 3; ++corner) {
    p += point.barycentric[corner] *
         vertex_position(mesh_, basis, mesh_.triangles[3 * std::size_t{point.triangle} + corner]);
  }
  return p;
}

}  // namespace perimap

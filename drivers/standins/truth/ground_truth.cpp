#include "drivers/standins/truth/ground_truth.hpp"

#include <algorithm>
#include <array>

namespace perimap {

Expected<GroundTruth> GroundTruth::create(HeartMesh mesh_W, HeartMotion motion, std::vector<CameraTruth> cameras) {
  if (const auto good = check(mesh_W); !good) return tl::unexpected(good.error());
  if (const auto good = check(motion); !good) return tl::unexpected(good.error());
  std::sort(cameras.begin(), cameras.end(),
            [](const CameraTruth& a, const CameraTruth& b) { return a.capture < b.capture; });
  return GroundTruth(std::move(mesh_W), std::move(motion), std::move(cameras));
}

std::optional<Pose> GroundTruth::camera_pose(Instant capture) const noexcept {
  const CameraTruth* found = camera(capture);
  if (found == nullptr) return std::nullopt;
  return found->X_WC;
}

const CameraTruth* GroundTruth::camera(Instant capture) const noexcept {
  const auto found =
      std::lower_bound(cameras_.begin(), cameras_.end(), capture,
                       [](const CameraTruth& camera, Instant instant) { return camera.capture < instant; });
  if (found == cameras_.end() || found->capture != capture) return nullptr;
  return &*found;
}

void GroundTruth::vertices_at(Instant t, std::span<Vector3d> out) const {
  const auto basis = fourier_basis(phase(t).phase_rad, mesh_.harmonics);
  vertex_positions(mesh_, basis, out);
  const Vector3d breathing = respiration_displacement(motion_, t);
  for (Vector3d& p : out) p += breathing;
  if (!trace_.empty()) {
    const TracedPlace traced(trace_, t);
    for (std::uint32_t vertex = 0; vertex < mesh_.vertex_count; ++vertex) {
      out[vertex] += traced.displacement(rest(vertex));
    }
  }
  if (organ_.empty()) return;
  const OrganPlace place = organ_.at(t);
  for (std::uint32_t vertex = 0; vertex < mesh_.vertex_count; ++vertex) {
    out[vertex] = place.of(out[vertex], rest(vertex));
  }
}

void GroundTruth::set_procedure(OrganMotion organ, std::vector<Drift> camera_delays) {
  organ_ = std::move(organ);
  camera_delays_ = std::move(camera_delays);
}

Expected<void> GroundTruth::set_trace(SurfaceTrace trace) {
  if (auto good = check(trace); !good) return good;
  trace_ = std::move(trace);
  return {};
}

Vector3d GroundTruth::rest(std::uint32_t vertex) const noexcept {
  const std::size_t axis = mesh_.coefficients_per_axis();
  const double* const series = mesh_.coefficients_mm.data() + 3 * axis * vertex;
  return {series[0], series[axis], series[2 * axis]};
}

SurfaceView GroundTruth::view(const Pose& X_WC, Instant t) const {
  std::vector<Vector3d> p_C(mesh_.vertex_count);
  vertices_at(t, p_C);
  const Pose X_CW = X_WC.inverse();
  for (Vector3d& p : p_C) p = X_CW * p;
  return {p_C, mesh_.triangles};
}

std::optional<SurfacePoint> GroundTruth::first_hit(const Pose& X_WC, const Vector3d& ray_C, Instant t) const {
  return view(X_WC, t).first_hit(ray_C);
}

Vector3d GroundTruth::position(const SurfacePoint& point, Instant t) const {
  const auto basis = fourier_basis(phase(t).phase_rad, mesh_.harmonics);
  const Vector3d breathing = respiration_displacement(motion_, t);
  const std::uint32_t* const corners = mesh_.triangles.data() + 3 * std::size_t{point.triangle};
  std::array<Vector3d, 3> moved;
  for (std::size_t corner = 0; corner < 3; ++corner) {
    moved[corner] = vertex_position(mesh_, basis, corners[corner]) + breathing;
  }
  if (!trace_.empty()) {
    const TracedPlace traced(trace_, t);
    for (std::size_t corner = 0; corner < 3; ++corner) moved[corner] += traced.displacement(rest(corners[corner]));
  }
  if (!organ_.empty()) {
    const OrganPlace place = organ_.at(t);
    for (std::size_t corner = 0; corner < 3; ++corner) moved[corner] = place.of(moved[corner], rest(corners[corner]));
  }
  Vector3d p = Vector3d::Zero();
  for (std::size_t corner = 0; corner < 3; ++corner) p += point.barycentric[corner] * moved[corner];
  return p;
}

}  // namespace perimap

// The surface's mesh at one instant, and the place of it that is nearest to a point.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

#include "core/geometry/mesh_border.hpp"
#include "core/geometry/pose.hpp"
#include "core/periodic/basis.hpp"
#include "core/phase/cardiac_clock.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/surface/surface_mesh.hpp"

namespace perimap {

// A place of the surface, and what is known of it there.
struct PlaceOnSurface {
  bool any = false;        // false: the mesh has no triangle, or the point is not finite; the rest means nothing
  bool on_border = false;  // beyond it nothing is known
  Vector3d point_W_mm = Vector3d::Zero();
  Vector3d normal_W = Vector3d::UnitZ();  // unit, towards where the camera was
  double distance_mm = 0.0;               // of the point that was asked for: positive in front, negative within
  Vector3d velocity_W_mm_per_s = Vector3d::Zero();
  double variance_mm2 = 0.0;  // of the place along the normal
};

// Memory is taken with the largest mesh so far; nothing is allocated for one of its size. Used by one thread.
class MovedSurface {
 public:
  // Room for so many vertices is taken at once.
  explicit MovedSurface(std::size_t vertices);

  // To the phases of an instant. The mesh must outlive the questions that follow, or the next move.
  void move(const SurfaceMesh& mesh, const PhaseEstimate& phase, const RespiratoryPhase& respiration) noexcept;

  // Takes time in proportion to the triangles.
  [[nodiscard]] PlaceOnSurface nearest(const MeshBorder& border, const Vector3d& p_W_mm) const noexcept;

 private:
  [[nodiscard]] Vector3d position(std::size_t vertex) const noexcept {
    return positions_.segment<3>(static_cast<Eigen::Index>(3 * vertex));
  }
  [[nodiscard]] Vector3d normal_at(std::size_t triangle, const Vector3d& shares) const noexcept;
  [[nodiscard]] double variance_along(std::uint32_t vertex, const Vector3d& n) const noexcept;

  const SurfaceMesh* mesh_ = nullptr;
  Eigen::VectorXd positions_;  // 3 V
  Basis rate_;                 // db/dt, 1/s
  Basis earlier_;              // less b: one deviation of the phase
  Basis later_;
  Basis b_;
  double breath_mm2_ = 0.0;
};

}  // namespace perimap

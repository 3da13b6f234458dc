// The surface before one camera at one instant: which material point does a ray meet?
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/pose.hpp"
#include "drivers/standins/truth/triangle_rays.hpp"

namespace perimap {

// A point fixed to the material: it moves with its triangle's corners.
struct SurfacePoint {
  std::uint32_t triangle = 0;
  std::array<double, 3> barycentric{};  // weights of the triangle's three vertices, not negative, sum 1
};

// Made once for many rays: all that depends on the instant is done here.
class SurfaceView {
 public:
  // Vertices in the camera's frame C, mm; vertex indices, three a triangle.
  SurfaceView(std::span<const Vector3d> p_C, std::span<const std::uint32_t> triangles);

  // What the ray meets first: the front-most triangle, whichever side it shows. `ray_C` points from the projection
  // centre, in any length. Nothing when the ray misses the surface.
  [[nodiscard]] std::optional<SurfacePoint> first_hit(const Vector3d& ray_C) const noexcept;

 private:
  std::vector<TriangleRays> triangles_;
};

}  // namespace perimap

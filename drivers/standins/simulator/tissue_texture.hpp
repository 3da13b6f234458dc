// The heart's appearance as an image: the solid tissue evaluated once over a flat chart of the surface, in several
// resolutions.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/pose.hpp"
#include "drivers/standins/simulator/parallel_for.hpp"
#include "drivers/standins/simulator/tissue.hpp"

namespace perimap {

// Four numbers that are computed with together: albedo and the three of the bump.
using Float4 __attribute__((vector_size(16))) = float;

class TissueTexture {
 public:
  using TissueAt = TissueSample (*)(const Eigen::Vector3f& p_mm, std::uint32_t seed) noexcept;

  // The chart is the azimuthal equidistant projection from `centre`, about the direction `axis`: it shows the side that
  // `axis` points to whole, and leaves out what lies more than 120 degrees from it.
  // `material_mm`: places of the mesh's vertices at end-diastole. `size`: texels a side, a power of two.
  TissueTexture(std::span<const Vector3d> material_mm, std::span<const std::uint32_t> triangles, const Vector3d& centre,
                const Vector3d& axis, int size, TissueAt tissue_at, std::uint32_t seed,
                const ParallelFor& parallel_for);

  // Chart coordinates of a vertex, in texels of the finest level (texel centres at integers).
  [[nodiscard]] const Eigen::Vector2f& uv(std::uint32_t vertex) const noexcept { return uv_[vertex]; }

  // Texels a side of the finest level.
  [[nodiscard]] int size() const noexcept { return levels_.front().size; }

  // Albedo and bump (as in TissueSample) at chart coordinates in texels of the finest level, trilinearly filtered.
  // Level 0 is the finest; each further one has half the resolution. Clamps what lies outside.
  [[nodiscard]] Float4 at(float u, float v, float level) const noexcept;

 private:
  struct Texel {
    std::uint8_t value[4];
  };
  struct Level {
    int size = 0;
    std::vector<Texel> texels;
  };

  [[nodiscard]] static Float4 bilinear(const Level& level, float u, float v) noexcept;

  std::vector<Eigen::Vector2f> uv_;
  std::vector<Level> levels_;
};

}  // namespace perimap

// Noise in space that solid textures are made of: functions of place and seed alone.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>

namespace perimap::solid {

[[nodiscard]] inline float smoothstep(float low, float high, float x) noexcept {
  const float t = std::clamp((x - low) / (high - low), 0.0F, 1.0F);
  return t * t * (3.0F - 2.0F * t);
}

struct NoiseSample {
  float value;
  Eigen::Vector3f slope;  // by place
};

// Perlin's gradient noise, about -0.9 to 0.9, one feature a unit.
[[nodiscard]] NoiseSample noise_with_slope(const Eigen::Vector3f& p, std::uint32_t seed) noexcept;
[[nodiscard]] inline float noise(const Eigen::Vector3f& p, std::uint32_t seed) noexcept {
  return noise_with_slope(p, seed).value;
}

// Octaves of noise, each half as large and half as strong; the first has features of one unit.
[[nodiscard]] float octaves(Eigen::Vector3f p, int count, std::uint32_t seed) noexcept;

// Distance to the nearest of the points strewn one a unit cell (Worley, "A cellular texture basis function", 1996).
[[nodiscard]] float cell_distance(const Eigen::Vector3f& p, std::uint32_t seed) noexcept;

// About how far, in mm, the nearest zero of a noise with features of `size_mm` lies, to first order: its zero surface
// cuts a body in winding lines, which serve as vessels.
[[nodiscard]] float line_distance_mm(const Eigen::Vector3f& p_mm, float size_mm, std::uint32_t seed) noexcept;

}  // namespace perimap::solid

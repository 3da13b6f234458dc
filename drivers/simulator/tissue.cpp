#include "drivers/simulator/tissue.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

using Eigen::Vector3f;

constexpr std::uint32_t lattice_hash(int x, int y, int z, std::uint32_t seed) noexcept {
  std::uint32_t h = seed ^ (static_cast<std::uint32_t>(x) * 0x8da6b343u) ^
                    (static_cast<std::uint32_t>(y) * 0xd8163841u) ^ (static_cast<std::uint32_t>(z) * 0xcb1ab31fu);
  h ^= h >> 16;
  h *= 0x7feb352du;
  h ^= h >> 15;
  h *= 0x846ca68bu;
  return h ^ (h >> 16);
}

int floor_to_int(float x) noexcept {
  const int truncated = static_cast<int>(x);
  return truncated - (static_cast<float>(truncated) > x ? 1 : 0);
}

float smoothstep(float low, float high, float x) noexcept {
  const float t = std::clamp((x - low) / (high - low), 0.0F, 1.0F);
  return t * t * (3.0F - 2.0F * t);
}

// One of the twelve cube-edge directions, dotted with the offset (Perlin, "Improving noise", SIGGRAPH 2002).
float gradient(std::uint32_t hash, float x, float y, float z) noexcept {
  const std::uint32_t h = hash & 15u;
  const float u = h < 8 ? x : y;
  const float v = h < 4 ? y : (h == 12 || h == 14 ? x : z);
  return ((h & 1u) != 0 ? -u : u) + ((h & 2u) != 0 ? -v : v);
}

// Perlin's gradient noise, about -0.9 to 0.9, one feature a unit.
float noise(const Vector3f& p, std::uint32_t seed) noexcept {
  const int ix = floor_to_int(p.x());
  const int iy = floor_to_int(p.y());
  const int iz = floor_to_int(p.z());
  const float x = p.x() - static_cast<float>(ix);
  const float y = p.y() - static_cast<float>(iy);
  const float z = p.z() - static_cast<float>(iz);
  const auto fade = [](float t) { return t * t * t * (t * (t * 6.0F - 15.0F) + 10.0F); };
  const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
  const float u = fade(x);
  const float v = fade(y);
  const float w = fade(z);
  const auto corner = [&](int dx, int dy, int dz) {
    return gradient(lattice_hash(ix + dx, iy + dy, iz + dz, seed), x - static_cast<float>(dx),
                    y - static_cast<float>(dy), z - static_cast<float>(dz));
  };
  const float near_z = mix(mix(corner(0, 0, 0), corner(1, 0, 0), u), mix(corner(0, 1, 0), corner(1, 1, 0), u), v);
  const float far_z = mix(mix(corner(0, 0, 1), corner(1, 0, 1), u), mix(corner(0, 1, 1), corner(1, 1, 1), u), v);
  return mix(near_z, far_z, w);
}

// Octaves of noise, each half as large and half as strong; the first has features of one unit.
float octaves(Vector3f p, int count, std::uint32_t seed) noexcept {
  float sum = 0.0F;
  float strength = 1.0F;
  for (int octave = 0; octave < count; ++octave) {
    sum += strength * noise(p, seed + static_cast<std::uint32_t>(octave));
    p *= 2.03F;  // not 2, so that lattice points of different octaves do not coincide
    strength *= 0.5F;
  }
  return sum;
}

// Distance to the nearest of the points strewn one a unit cell (Worley, "A cellular texture basis function", 1996).
float cell_distance(const Vector3f& p, std::uint32_t seed) noexcept {
  const int ix = floor_to_int(p.x());
  const int iy = floor_to_int(p.y());
  const int iz = floor_to_int(p.z());
  float nearest = 1e9F;
  for (int dz = -1; dz <= 1; ++dz)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const std::uint32_t h = lattice_hash(ix + dx, iy + dy, iz + dz, seed);
        const auto fraction = [h](int shift) { return static_cast<float>((h >> shift) & 1023u) / 1024.0F; };
        const Vector3f point(static_cast<float>(ix + dx) + fraction(0), static_cast<float>(iy + dy) + fraction(10),
                             static_cast<float>(iz + dz) + fraction(20));
        nearest = std::min(nearest, (point - p).squaredNorm());
      }
  return std::sqrt(nearest);
}

// About how far, in mm, the nearest zero of a noise with features of `size_mm` lies, to first order: its zero surface
// cuts the heart in winding lines, which serve as vessels.
float line_distance_mm(const Vector3f& p_mm, float size_mm, std::uint32_t seed) noexcept {
  const Vector3f p = p_mm / size_mm;
  constexpr float kStep = 0.02F;
  const float value = noise(p, seed);
  const Vector3f slope(noise(p + kStep * Vector3f::UnitX(), seed) - value,
                       noise(p + kStep * Vector3f::UnitY(), seed) - value,
                       noise(p + kStep * Vector3f::UnitZ(), seed) - value);
  return std::abs(value) * size_mm / (slope.norm() / kStep + 0.1F);
}

}  // namespace

TissueSample tissue_at(const Vector3f& p_mm, std::uint32_t seed) noexcept {
  const Vector3f warp(noise(p_mm / 11.0F, seed + 11), noise(p_mm / 11.0F, seed + 12), noise(p_mm / 11.0F, seed + 13));
  const Vector3f q = p_mm + 3.5F * warp;

  // Muscle: blotches at every size, and fibres, fine across and long along an oblique direction.
  float albedo = 0.43F + 0.17F * octaves(p_mm / 5.0F, 4, seed + 20);
  const Vector3f along = Vector3f(0.55F, 0.25F, -0.80F).normalized();
  const Vector3f fibre = q / 1.6F - along * (along.dot(q) * (1.0F / 1.6F - 1.0F / 9.0F));
  albedo += 0.09F * noise(fibre, seed + 30);

  const float large = line_distance_mm(q, 30.0F, seed + 40);
  const float medium = line_distance_mm(q, 12.0F, seed + 41);
  const float small = line_distance_mm(q, 6.0F, seed + 42);

  // Fat lies along the large vessels and in islands, in lobules with darker seams.
  const float islands = octaves(q / 22.0F, 3, seed + 50);
  const float fat = smoothstep(0.10F, 0.26F, islands + 0.30F * (1.0F - smoothstep(1.0F, 6.0F, large)));
  if (fat > 0.0F) {
    const float lobule = cell_distance(q / 2.6F, seed + 60);
    const float fat_albedo =
        0.74F - 0.34F * smoothstep(0.35F, 0.85F, lobule) + 0.10F * octaves(p_mm / 2.0F, 2, seed + 61);
    albedo += fat * (fat_albedo - albedo);
  }

  // Vessels: dark blood with a faintly brighter wall; fat covers the small ones.
  const auto vessel = [&](float distance, float radius, float strength) {
    const float blood = strength * (1.0F - smoothstep(0.75F * radius, 1.25F * radius, distance));
    const float wall = 0.35F * strength * smoothstep(0.9F * radius, 1.4F * radius, distance) *
                       (1.0F - smoothstep(1.5F * radius, 2.4F * radius, distance));
    albedo += blood * (0.20F - albedo) + wall * 0.25F;
  };
  vessel(small, 0.22F, 0.55F * (1.0F - fat));
  vessel(medium, 0.42F, 0.65F * (1.0F - 0.7F * fat));
  vessel(large, 0.85F, 0.75F);

  TissueSample sample;
  sample.albedo = std::clamp(albedo, 0.03F, 0.98F);
  const Vector3f b = p_mm / 1.9F;
  sample.bump = 0.10F * Vector3f(octaves(b, 2, seed + 70), octaves(b, 2, seed + 73), octaves(b, 2, seed + 76));
  return sample;
}

}  // namespace perimap

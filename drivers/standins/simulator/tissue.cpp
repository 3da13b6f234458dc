#include "drivers/standins/simulator/tissue.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

using Eigen::Vector3f;

constexpr std::uint32_t lattice_hash(int x, int y, int z, std::uint32_t seed) noexcept {
  std::uint32_t h = seed ^ (static_cast<std::uint32_t>(x) * 0x8da6b343U) ^
                    (static_cast<std::uint32_t>(y) * 0xd8163841U) ^ (static_cast<std::uint32_t>(z) * 0xcb1ab31fU);
  h ^= h >> 16;
  h *= 0x7feb352dU;
  h ^= h >> 15;
  h *= 0x846ca68bU;
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

// The twelve cube-edge directions, four of them twice (Perlin, "Improving noise", SIGGRAPH 2002).
constexpr float kGradients[16][3] = {{1, 1, 0},  {-1, 1, 0},  {1, -1, 0}, {-1, -1, 0}, {1, 0, 1},  {-1, 0, 1},
                                     {1, 0, -1}, {-1, 0, -1}, {0, 1, 1},  {0, -1, 1},  {0, 1, -1}, {0, -1, -1},
                                     {1, 1, 0},  {0, -1, 1},  {-1, 1, 0}, {0, -1, -1}};

struct NoiseSample {
  float value;
  Vector3f slope;  // by place
};

// Perlin's gradient noise, about -0.9 to 0.9, one feature a unit.
NoiseSample noise_with_slope(const Vector3f& p, std::uint32_t seed) noexcept {
  const int cell[3] = {floor_to_int(p.x()), floor_to_int(p.y()), floor_to_int(p.z())};
  // Of each axis: the weight of the cell's lower and upper side, and how the upper one's changes.
  float offset[3];
  float weight[3][2];
  float change[3];
  for (int axis = 0; axis < 3; ++axis) {
    const float t = p[axis] - static_cast<float>(cell[axis]);
    offset[axis] = t;
    weight[axis][1] = t * t * t * (t * (t * 6.0F - 15.0F) + 10.0F);
    weight[axis][0] = 1.0F - weight[axis][1];
    change[axis] = 30.0F * t * t * (t * (t - 2.0F) + 1.0F);
  }
  NoiseSample sample{0.0F, Vector3f::Zero()};
  for (int corner = 0; corner < 8; ++corner) {
    const int d[3] = {corner & 1, (corner >> 1) & 1, corner >> 2};
    const float* g = kGradients[lattice_hash(cell[0] + d[0], cell[1] + d[1], cell[2] + d[2], seed) & 15U];
    const float value = g[0] * (offset[0] - static_cast<float>(d[0])) + g[1] * (offset[1] - static_cast<float>(d[1])) +
                        g[2] * (offset[2] - static_cast<float>(d[2]));
    const float w[3] = {weight[0][d[0]], weight[1][d[1]], weight[2][d[2]]};
    const float all = w[0] * w[1] * w[2];
    sample.value += all * value;
    sample.slope += all * Vector3f(g[0], g[1], g[2]);
    sample.slope.x() += (d[0] != 0 ? change[0] : -change[0]) * w[1] * w[2] * value;
    sample.slope.y() += (d[1] != 0 ? change[1] : -change[1]) * w[0] * w[2] * value;
    sample.slope.z() += (d[2] != 0 ? change[2] : -change[2]) * w[0] * w[1] * value;
  }
  return sample;
}

float noise(const Vector3f& p, std::uint32_t seed) noexcept { return noise_with_slope(p, seed).value; }

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
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const std::uint32_t h = lattice_hash(ix + dx, iy + dy, iz + dz, seed);
        const auto fraction = [h](int shift) { return static_cast<float>((h >> shift) & 1023U) / 1024.0F; };
        const Vector3f point(static_cast<float>(ix + dx) + fraction(0), static_cast<float>(iy + dy) + fraction(10),
                             static_cast<float>(iz + dz) + fraction(20));
        nearest = std::min(nearest, (point - p).squaredNorm());
      }
    }
  }
  return std::sqrt(nearest);
}

// About how far, in mm, the nearest zero of a noise with features of `size_mm` lies, to first order: its zero surface
// cuts the heart in winding lines, which serve as vessels.
float line_distance_mm(const Vector3f& p_mm, float size_mm, std::uint32_t seed) noexcept {
  const NoiseSample sample = noise_with_slope(p_mm / size_mm, seed);
  return std::abs(sample.value) * size_mm / (sample.slope.norm() + 0.1F);
}

}  // namespace

TissueSample tissue_at(const Vector3f& p_mm, std::uint32_t seed) noexcept {
  const Vector3f warp(noise(p_mm / 11.0F, seed + 11), noise(p_mm / 11.0F, seed + 12), noise(p_mm / 11.0F, seed + 13));
  const Vector3f q = p_mm + 3.5F * warp;

  // Muscle: blotches at every size, and fibres, fine across and long along an oblique direction.
  float albedo = 0.44F + 0.19F * octaves(p_mm / 5.0F, 4, seed + 20);
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
    const float edge = std::max(0.25F * radius, 0.17F);  // mm, nothing sharper than the texture can hold
    const float blood = strength * (1.0F - smoothstep(radius - edge, radius + edge, distance));
    const float wall = 0.35F * strength * smoothstep(0.9F * radius, 1.4F * radius, distance) *
                       (1.0F - smoothstep(1.5F * radius, 2.4F * radius, distance));
    albedo += blood * (0.20F - albedo) + wall * 0.25F;
  };
  vessel(small, 0.20F, 0.60F * (1.0F - fat));
  vessel(medium, 0.42F, 0.65F * (1.0F - 0.7F * fat));
  vessel(large, 0.85F, 0.75F);

  TissueSample sample;
  sample.albedo = std::clamp(albedo, 0.03F, 0.98F);
  // The film of fluid dips and rises by some hundredths of a millimetre.
  sample.bump =
      0.055F * (noise_with_slope(p_mm / 2.2F, seed + 70).slope + noise_with_slope(p_mm / 1.0F, seed + 71).slope);
  return sample;
}

}  // namespace perimap

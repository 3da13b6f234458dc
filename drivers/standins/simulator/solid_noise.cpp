#include "drivers/standins/simulator/solid_noise.hpp"

#include <cmath>

namespace perimap::solid {
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

// The twelve cube-edge directions, four of them twice (Perlin, "Improving noise", SIGGRAPH 2002).
constexpr float kGradients[16][3] = {{1, 1, 0},  {-1, 1, 0},  {1, -1, 0}, {-1, -1, 0}, {1, 0, 1},  {-1, 0, 1},
                                     {1, 0, -1}, {-1, 0, -1}, {0, 1, 1},  {0, -1, 1},  {0, 1, -1}, {0, -1, -1},
                                     {1, 1, 0},  {0, -1, 1},  {-1, 1, 0}, {0, -1, -1}};

}  // namespace

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

float line_distance_mm(const Vector3f& p_mm, float size_mm, std::uint32_t seed) noexcept {
  const NoiseSample sample = noise_with_slope(p_mm / size_mm, seed);
  return std::abs(sample.value) * size_mm / (sample.slope.norm() + 0.1F);
}

}  // namespace perimap::solid

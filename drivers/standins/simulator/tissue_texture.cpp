#include "drivers/standins/simulator/tissue_texture.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace perimap {
namespace {

constexpr double kChartRadius_rad = 2.1;
constexpr int kRowsPerBand = 32;
constexpr float kBumpRange = 0.5F;  // stored bump: -0.5 .. 0.5

std::uint8_t quantised(float value) noexcept {
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0F, 1.0F) * 255.0F));
}

// Four bytes as four floats, by two interleavings with zeros: compilers make single instructions of these, but not of a
// conversion of four bytes.
Float4 widened(const void* bytes) noexcept {
  using Bytes16 __attribute__((vector_size(16))) = std::uint8_t;
  using Shorts8 __attribute__((vector_size(16))) = std::uint16_t;
  using Ints4 __attribute__((vector_size(16))) = std::int32_t;
  static_assert(std::endian::native == std::endian::little);
  std::int32_t word = 0;
  std::memcpy(&word, bytes, sizeof word);
  const auto narrow = std::bit_cast<Bytes16>(Ints4{word, 0, 0, 0});
  const auto middle = std::bit_cast<Shorts8>(
      __builtin_shufflevector(narrow, Bytes16{}, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23));
  const auto wide = std::bit_cast<Ints4>(__builtin_shufflevector(middle, Shorts8{}, 0, 8, 1, 9, 2, 10, 3, 11));
  return __builtin_convertvector(wide, Float4);
}

float cross(const Eigen::Vector2f& a, const Eigen::Vector2f& b) noexcept { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace

TissueTexture::TissueTexture(std::span<const Vector3d> material_mm, std::span<const std::uint32_t> triangles,
                             const Vector3d& centre, const Vector3d& axis, int size, TissueAt tissue_at,
                             std::uint32_t seed, const ParallelFor& parallel_for) {
  const Vector3d z = axis.normalized();
  const Vector3d x = z.unitOrthogonal();
  const Vector3d y = z.cross(x);
  const double middle = 0.5 * (size - 1);
  std::vector<bool> on_chart;
  uv_.reserve(material_mm.size());
  for (const Vector3d& p : material_mm) {
    const Vector3d direction = (p - centre).normalized();
    const double angle = std::acos(std::clamp(direction.dot(z), -1.0, 1.0));
    on_chart.push_back(angle < kChartRadius_rad);
    const Vector2d azimuth = Vector2d(direction.dot(x), direction.dot(y)).normalized();
    uv_.emplace_back((azimuth * angle * middle / kChartRadius_rad + Vector2d::Constant(middle)).cast<float>());
  }

  // Each texel lies in one triangle of the chart, which says what point of the material it shows.
  levels_.push_back({size, std::vector<Texel>(static_cast<std::size_t>(size) * size, Texel{})});
  std::vector<std::uint8_t> covered(levels_.front().texels.size(), 0);
  const int bands = (size + kRowsPerBand - 1) / kRowsPerBand;
  parallel_for(bands, [&](int band) {
    const int first_row = band * kRowsPerBand;
    const int last_row = std::min(size, first_row + kRowsPerBand) - 1;
    for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
      const Eigen::Vector2f a = uv_[triangles[t]];
      const Eigen::Vector2f b = uv_[triangles[t + 1]];
      const Eigen::Vector2f c = uv_[triangles[t + 2]];
      const float area = cross(b - a, c - a);
      // Triangles about the far pole lie across the whole chart, inside out.
      if (!on_chart[triangles[t]] || !on_chart[triangles[t + 1]] || !on_chart[triangles[t + 2]]) continue;
      if (std::abs(area) < 1e-6F) continue;
      const int y_0 = std::max(first_row, static_cast<int>(std::ceil(std::min({a.y(), b.y(), c.y()}))));
      const int y_1 = std::min(last_row, static_cast<int>(std::floor(std::max({a.y(), b.y(), c.y()}))));
      const int x_0 = std::max(0, static_cast<int>(std::ceil(std::min({a.x(), b.x(), c.x()}))));
      const int x_1 = std::min(size - 1, static_cast<int>(std::floor(std::max({a.x(), b.x(), c.x()}))));
      for (int row = y_0; row <= y_1; ++row) {
        for (int column = x_0; column <= x_1; ++column) {
          const std::size_t texel = static_cast<std::size_t>(row) * size + column;
          if (covered[texel] != 0) continue;
          const Eigen::Vector2f p(static_cast<float>(column), static_cast<float>(row));
          const float w_a = cross(b - p, c - p) / area;
          const float w_b = cross(c - p, a - p) / area;
          const float w_c = 1.0F - w_a - w_b;
          if (w_a < -1e-5F || w_b < -1e-5F || w_c < -1e-5F) continue;
          const Vector3d material = w_a * material_mm[triangles[t]] + w_b * material_mm[triangles[t + 1]] +
                                    w_c * material_mm[triangles[t + 2]];
          const TissueSample tissue = tissue_at(material.cast<float>(), seed);
          Texel& out = levels_.front().texels[texel];
          out.value[0] = quantised(tissue.albedo);
          for (int i = 0; i < 3; ++i) out.value[i + 1] = quantised(tissue.bump[i] / (2.0F * kBumpRange) + 0.5F);
          covered[texel] = 1;
        }
      }
    }
  });

  // Coarser levels: the mean of the covered ones among four.
  std::vector<std::vector<std::uint8_t>> coverage{std::move(covered)};
  while (levels_.back().size > 1) {
    const Level& fine = levels_.back();
    const std::vector<std::uint8_t>& fine_covered = coverage.back();
    Level coarse{fine.size / 2, {}};
    coarse.texels.resize(static_cast<std::size_t>(coarse.size) * coarse.size);
    std::vector<std::uint8_t> coarse_covered(coarse.texels.size(), 0);
    for (int row = 0; row < coarse.size; ++row) {
      for (int column = 0; column < coarse.size; ++column) {
        int sum[4] = {};
        int count = 0;
        for (int i = 0; i < 4; ++i) {
          const std::size_t from = static_cast<std::size_t>(2 * row + i / 2) * fine.size + (2 * column + i % 2);
          if (fine_covered[from] == 0) continue;
          ++count;
          for (int channel = 0; channel < 4; ++channel) sum[channel] += fine.texels[from].value[channel];
        }
        if (count == 0) continue;
        const std::size_t to = static_cast<std::size_t>(row) * coarse.size + column;
        coarse_covered[to] = 1;
        for (int channel = 0; channel < 4; ++channel)
          coarse.texels[to].value[channel] = static_cast<std::uint8_t>((sum[channel] + count / 2) / count);
      }
    }
    levels_.push_back(std::move(coarse));
    coverage.push_back(std::move(coarse_covered));
  }
  // Texels beside the surface's edge take what the next coarser level has there, so that no filter reads a hole.
  for (std::size_t level = levels_.size() - 1; level-- > 0;) {
    Level& fine = levels_[level];
    const Level& coarse = levels_[level + 1];
    for (int row = 0; row < fine.size; ++row) {
      for (int column = 0; column < fine.size; ++column) {
        const std::size_t to = static_cast<std::size_t>(row) * fine.size + column;
        if (coverage[level][to] == 0)
          fine.texels[to] = coarse.texels[static_cast<std::size_t>(row / 2) * coarse.size + column / 2];
      }
    }
  }
}

Float4 TissueTexture::bilinear(const Level& level, float u, float v) noexcept {
  const float limit = static_cast<float>(level.size - 1);
  u = std::clamp(u, 0.0F, limit);
  v = std::clamp(v, 0.0F, limit);
  const int column = std::min(static_cast<int>(u), std::max(0, level.size - 2));
  const int row = std::min(static_cast<int>(v), std::max(0, level.size - 2));
  const float du = u - static_cast<float>(column);
  const float dv = v - static_cast<float>(row);
  const int right = level.size > 1 ? 1 : 0;
  const Texel* upper = level.texels.data() + static_cast<std::ptrdiff_t>(row) * level.size + column;
  const Texel* lower = upper + static_cast<std::ptrdiff_t>(right) * level.size;
  const Float4 top = widened(upper) + du * (widened(upper + right) - widened(upper));
  const Float4 bottom = widened(lower) + du * (widened(lower + right) - widened(lower));
  return top + dv * (bottom - top);
}

Float4 TissueTexture::at(float u, float v, float level) const noexcept {
  const float bounded = std::clamp(level, 0.0F, static_cast<float>(levels_.size() - 1));
  const auto fine = static_cast<std::size_t>(bounded);
  const float between = bounded - static_cast<float>(fine);
  // A texel of level n covers 2^n of level 0, so its centre lies (2^n - 1) / 2 from its first one's.
  const auto in_level = [&](std::size_t n) {
    const float scale = 1.0F / static_cast<float>(1U << n);
    return bilinear(levels_[n], (u + 0.5F) * scale - 0.5F, (v + 0.5F) * scale - 0.5F);
  };
  Float4 value = in_level(fine);
  if (between > 0.0F) value += between * (in_level(fine + 1) - value);
  const Float4 scale = {1.0F / 255.0F, 2.0F * kBumpRange / 255.0F, 2.0F * kBumpRange / 255.0F,
                        2.0F * kBumpRange / 255.0F};
  const Float4 offset = {0.0F, -kBumpRange, -kBumpRange, -kBumpRange};
  return value * scale + offset;
}

}  // namespace perimap

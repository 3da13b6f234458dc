#include "drivers/standins/simulator/view_drawing.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "core/angle/angle.hpp"
#include "drivers/standins/random/counter_noise.hpp"

namespace perimap {
namespace {

constexpr std::uint64_t kCloudStream = 0x6f627374 + 2;
constexpr std::uint64_t kBloodStream = 0x626c6f6f64;
constexpr std::uint64_t kBandStream = 0x62616e64;
constexpr float kScattered = 190.0F;  // grey levels, of smoke that nothing shines through

struct OnShaft {
  double along = 0.0;   // 0 at its beginning, 1 at the tip
  double across = 0.0;  // px from its axis, with a sign; beyond the tip the distance from it
};

OnShaft on_shaft(const Vector2d& from, const Vector2d& tip, const Vector2d& px) noexcept {
  const Vector2d axis = tip - from;
  const Vector2d d = px - from;
  const double along = d.dot(axis) / axis.squaredNorm();
  if (along > 1.0) return {along, (px - tip).norm()};
  return {along, (axis.x() * d.y() - axis.y() * d.x()) / axis.norm()};
}

}  // namespace

bool ShaftPlace::covers(const Vector2d& px, double margin_px) const noexcept {
  const OnShaft place = on_shaft(from, tip, px);
  return place.along >= 0.0 && std::abs(place.across) <= half_width_px + margin_px;
}

void ViewDrawing::shaft(const ShaftPlace& place, std::span<float> radiance) const {
  for (int row = 0; row < height_; ++row) {
    for (int column = 0; column < width_; ++column) {
      const OnShaft pixel = on_shaft(place.from, place.tip, Vector2d(column, row));
      const double side = pixel.across / place.half_width_px;
      if (pixel.along < 0.0 || std::abs(side) > 1.0) continue;
      const double round = std::sqrt(1.0 - side * side);
      const double shine = std::exp(-40.0 * (side + 0.3) * (side + 0.3));
      radiance[at(row, column)] = static_cast<float>(25.0 + 90.0 * round + 150.0 * shine);
    }
  }
}

void ViewDrawing::clouds(std::uint64_t seed, double strength, double t_s, std::span<float> radiance) const {
  const CounterNoise noise(seed, kCloudStream);
  const auto depth_at = [&](double x, double y) {
    constexpr int kWaves = 6;
    double sum = 0.0;
    for (int wave = 0; wave < kWaves; ++wave) {
      const auto index = 4 * static_cast<std::uint64_t>(wave);
      const double direction = noise.uniform(index, 0.0, kTwoPi);
      const double length_px = noise.uniform(index + 1, 0.2, 0.8) * width_;
      const double rate_hz = noise.uniform(index + 2, 0.1, 0.5);
      sum += std::sin(kTwoPi * ((std::cos(direction) * x + std::sin(direction) * y) / length_px + rate_hz * t_s) +
                      noise.uniform(index + 3, 0.0, kTwoPi));
    }
    return strength * std::clamp(0.5 + sum / kWaves, 0.0, 1.0);
  };
  constexpr int kGrid_px = 16;
  const int columns = (width_ + kGrid_px - 1) / kGrid_px + 1, rows = (height_ + kGrid_px - 1) / kGrid_px + 1;
  std::vector<float> transmission;
  transmission.reserve(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      transmission.push_back(static_cast<float>(std::exp(-depth_at(column * kGrid_px, row * kGrid_px))));
    }
  }
  for (int row = 0; row < height_; ++row) {
    const float* const above = transmission.data() + static_cast<std::size_t>(row / kGrid_px) * columns;
    const float* const below = above + columns;
    const float down = static_cast<float>(row % kGrid_px) / kGrid_px;
    for (int column = 0; column < width_; ++column) {
      const int c = column / kGrid_px;
      const float right = static_cast<float>(column % kGrid_px) / kGrid_px;
      const float share = (1 - down) * ((1 - right) * above[c] + right * above[c + 1]) +
                          down * ((1 - right) * below[c] + right * below[c + 1]);
      float& seen = radiance[at(row, column)];
      seen = share * seen + (1 - share) * kScattered;
    }
  }
}

void ViewDrawing::fog(double depth, std::vector<float>& scratch, std::span<float> radiance) const {
  const auto share = static_cast<float>(std::exp(-depth));
  // A mean over a square, rows first: droplets on the lens are far out of focus.
  const int reach = static_cast<int>(std::lround(0.006 * width_ * std::min(depth, 3.0)));
  scratch.resize(radiance.size());
  const auto pass = [&](bool rows, std::span<const float> in, std::span<float> out) {
    for (int row = 0; row < height_; ++row) {
      for (int column = 0; column < width_; ++column) {
        float sum = 0.0F;
        for (int d = -reach; d <= reach; ++d) {
          const int r = rows ? row : std::clamp(row + d, 0, height_ - 1);
          const int c = rows ? std::clamp(column + d, 0, width_ - 1) : column;
          sum += in[at(r, c)];
        }
        out[at(row, column)] = sum / static_cast<float>(2 * reach + 1);
      }
    }
  };
  if (reach > 0) {
    pass(true, radiance, scratch);
    pass(false, scratch, radiance);
  }
  for (float& seen : radiance) seen = share * seen + (1 - share) * kScattered;
}

// A pool that stands in from one side so far that, with the drops, about the share is covered.
void ViewDrawing::blood(std::uint64_t seed, double share, std::span<float> radiance) const {
  if (!(share > 0.0)) return;
  const CounterNoise noise(seed, kBloodStream);
  const double direction = noise.uniform(0, 0.0, kTwoPi);
  const Vector2d inward(std::cos(direction), std::sin(direction));
  const Vector2d along(-inward.y(), inward.x());
  const double half = 0.5 * (std::abs(inward.x()) * width_ + std::abs(inward.y()) * height_);
  const double edge = half * (2.0 * share - 1.0);
  constexpr int kDrops = 12;
  constexpr float kBlood = 18.0F;  // grey levels: it lets hardly any light through
  for (int row = 0; row < height_; ++row) {
    for (int column = 0; column < width_; ++column) {
      const Vector2d px(column - 0.5 * width_, row - 0.5 * height_);
      const double wave = 0.06 * width_ * std::sin(px.dot(along) / (0.09 * width_) + noise.uniform(1, 0.0, kTwoPi));
      // px within the blood, of whatever covers it most.
      double inside = edge + wave - px.dot(inward);
      for (std::uint64_t drop = 0; drop < kDrops; ++drop) {
        const Vector2d middle(noise.uniform(4 * drop + 4, -0.5, 0.5) * width_,
                              noise.uniform(4 * drop + 5, -0.5, 0.5) * height_);
        const double radius = noise.uniform(4 * drop + 6, 0.2, 1.0) * 0.08 * width_ * share;
        inside = std::max(inside, radius - (px - middle).norm());
      }
      const auto cover = static_cast<float>(std::clamp(0.5 + inside / (0.02 * width_), 0.0, 1.0));
      float& seen = radiance[at(row, column)];
      seen = (1 - cover) * seen + cover * kBlood;
    }
  }
}

void ViewDrawing::cloth(double share, double t_s, std::span<float> radiance) const {
  const auto part = static_cast<float>(share);
  for (int row = 0; row < height_; ++row) {
    for (int column = 0; column < width_; ++column) {
      // Threads far out of focus, drawn past fast and to and fro.
      const double x = static_cast<double>(column) / width_ + 0.8 * std::sin(kTwoPi * 0.9 * t_s);
      const double y = static_cast<double>(row) / width_ + 0.2 * std::sin(kTwoPi * 0.7 * t_s);
      const double level = 150.0 + 30.0 * std::sin(kTwoPi * 2.0 * x) * std::cos(kTwoPi * 1.5 * y);
      float& seen = radiance[at(row, column)];
      seen = (1 - part) * seen + part * static_cast<float>(level);
    }
  }
}

void ViewDrawing::trocar(double share, std::span<float> radiance) const {
  const auto part = static_cast<float>(share);
  for (int row = 0; row < height_; ++row) {
    for (int column = 0; column < width_; ++column) {
      // A smooth tube that the scope's own light falls along: rings that grow brighter towards the rim.
      const double r = std::hypot(column - 0.5 * width_, row - 0.5 * height_) / (0.5 * width_);
      const double level = 12.0 + 70.0 * std::min(r, 1.2) * (0.8 + 0.2 * std::cos(14.0 * r));
      float& seen = radiance[at(row, column)];
      seen = (1 - part) * seen + part * static_cast<float>(level);
    }
  }
}

void ViewDrawing::bands(std::uint64_t seed, double levels, std::span<float> radiance) const {
  const CounterNoise noise(seed, kBandStream);
  constexpr int kBand_px = 6;
  for (int row = 0; row < height_; ++row) {
    const auto band = static_cast<std::uint64_t>(row / kBand_px);
    const auto level = static_cast<float>(noise.uniform(band, -levels, levels));
    for (int column = 0; column < width_; ++column) {
      float& seen = radiance[at(row, column)];
      seen = std::max(0.0F, seen + level);
    }
  }
}

}  // namespace perimap

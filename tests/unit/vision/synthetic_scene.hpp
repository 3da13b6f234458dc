// A smooth random texture with exact values everywhere, seen through known affine views.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <random>
#include <vector>

#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"

namespace perimap::test {

// Owns what a GreyImage borrows; rows may be padded.
struct ImageBuffer {
  ImageBuffer(int width_, int height_, int padding = 0)
      : width(width_), height(height_), stride(width_ + padding), pixels(static_cast<std::size_t>(stride * height_)) {}

  [[nodiscard]] GreyImage view() const { return {pixels.data(), width, height, stride}; }
  [[nodiscard]] std::uint8_t& at(int x, int y) { return pixels[static_cast<std::size_t>(y * stride + x)]; }

  int width, height, stride;
  std::vector<std::uint8_t> pixels;
};

// A sum of plane waves of random direction and phase, wavelengths spread evenly in their logarithm.
class Texture {
 public:
  explicit Texture(unsigned seed, double contrast = 22, double shortest_px = 7, double longest_px = 90) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    constexpr int kWaves = 40;
    for (int i = 0; i < kWaves; ++i) {
      const double wavelength = shortest_px * std::pow(longest_px / shortest_px, unit(random));
      const double direction = 2 * M_PI * unit(random);
      waves_.push_back({2 * M_PI / wavelength * std::cos(direction), 2 * M_PI / wavelength * std::sin(direction),
                        2 * M_PI * unit(random)});
    }
    amplitude_ = contrast * std::sqrt(2.0 / kWaves);
  }

  // Grey levels at p, p + step, p + 2 step …: a mean of 120, a standard deviation of the contrast.
  void along(const Vector2d& p, const Vector2d& step, std::vector<double>& grey) const {
    std::fill(grey.begin(), grey.end(), 120.0);
    for (const Wave& wave : waves_) {
      std::complex<double> value = std::polar(amplitude_, wave.kx * p.x() + wave.ky * p.y() + wave.phase);
      const std::complex<double> turn = std::polar(1.0, wave.kx * step.x() + wave.ky * step.y());
      for (double& g : grey) {
        g += value.imag();
        value *= turn;
      }
    }
  }

 private:
  struct Wave {
    double kx, ky, phase;
  };
  std::vector<Wave> waves_;
  double amplitude_;
};

// The texture's point p appears at pixel A p + t.
struct View {
  Matrix2d A = Matrix2d::Identity();
  Vector2d t = Vector2d::Zero();
  double gain = 1;
  double bias = 0;

  [[nodiscard]] Vector2d operator()(const Vector2d& p) const { return A * p + t; }
};

inline ImageBuffer render(const Texture& texture, const View& view, int width, int height, double noise_sigma,
                          std::mt19937& random, int padding = 0) {
  ImageBuffer image(width, height, padding);
  std::normal_distribution<double> noise(0, 1);
  const Matrix2d back = view.A.inverse();
  std::vector<double> row(static_cast<std::size_t>(width));
  for (int v = 0; v < height; ++v) {
    texture.along(back * (Vector2d(0, v) - view.t), back.col(0), row);
    for (int u = 0; u < width; ++u) {
      const double grey = view.gain * row[static_cast<std::size_t>(u)] + view.bias + noise_sigma * noise(random);
      image.at(u, v) = static_cast<std::uint8_t>(std::clamp(std::lround(grey), 0L, 255L));
    }
  }
  return image;
}

inline Matrix2d isotropic(double sigma_px) { return sigma_px * sigma_px * Matrix2d::Identity(); }

inline double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

}  // namespace perimap::test

#include "drivers/standins/simulator/board_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "drivers/standins/random/counter_noise.hpp"

namespace perimap {
namespace {

// Grey levels.
constexpr float kPaper = 205.0F;
constexpr float kInk = 28.0F;
constexpr float kTable = 95.0F;
constexpr float kNoise = 1.5F;  // standard deviation

constexpr int kSubsamples = 2;  // a side of a pixel

// How much of [from, to] lies in the texel [i, i + 1].
double overlap(double from, double to, int i) {
  return std::max(0.0, std::min(to, i + 1.0) - std::max(from, static_cast<double>(i)));
}

// A 3x3 binomial: the lens's blur.
void blur(std::vector<float>& image, int width, int height) {
  std::vector<float> rows(image.size());
  const auto at = [width](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float left = image[at(std::max(0, x - 1), y)];
      const float right = image[at(std::min(width - 1, x + 1), y)];
      rows[at(x, y)] = 0.25F * (left + right) + 0.5F * image[at(x, y)];
    }
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float above = rows[at(x, std::max(0, y - 1))];
      const float below = rows[at(x, std::min(height - 1, y + 1))];
      image[at(x, y)] = 0.25F * (above + below) + 0.5F * rows[at(x, y)];
    }
  }
}

}  // namespace

BoardRenderer::BoardRenderer(const ScopeLens& lens, const BoardPattern& pattern, const FieldStop& stop) : lens_(lens) {
  const int width = kSubsamples * lens.width;
  const int height = kSubsamples * lens.height;
  ray_x_.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  ray_y_.reserve(ray_x_.capacity());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Vector3d ray = lens.ray({(x + 0.5) / kSubsamples - 0.5, (y + 0.5) / kSubsamples - 0.5});
      ray_x_.push_back(static_cast<float>(ray.x()));
      ray_y_.push_back(static_cast<float>(ray.y()));
    }
  }
  const double half_diagonal = 0.5 * std::hypot(lens.width, lens.height);
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      const double r = std::hypot(x - lens.cx, y - lens.cy) / half_diagonal;
      light_.push_back(static_cast<float>((1.0 - 0.35 * r * r) * stop.passed(Vector2d(x, y))));
    }
  }
  draw_pattern(pattern);
}

// Each texel has the part of it that is black, exactly.
void BoardRenderer::draw_pattern(const BoardPattern& pattern) {
  constexpr double kMargin_mm = 8.0;
  const double longest = std::max(pattern.outline.width_mm, pattern.outline.height_mm) + 2.0 * kMargin_mm;
  constexpr double kMostTexels = 1800.0;
  texels_per_mm_ = std::min(12.0, kMostTexels / longest);
  left_mm_ = pattern.outline.x_mm - kMargin_mm;
  top_mm_ = pattern.outline.y_mm - kMargin_mm;
  columns_ = static_cast<int>(std::ceil((pattern.outline.width_mm + 2.0 * kMargin_mm) * texels_per_mm_));
  rows_ = static_cast<int>(std::ceil((pattern.outline.height_mm + 2.0 * kMargin_mm) * texels_per_mm_));
  texture_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), kPaper);
  for (const BoardRectangle& r : pattern.black) {
    const double x0 = (r.x_mm - left_mm_) * texels_per_mm_, x1 = x0 + r.width_mm * texels_per_mm_;
    const double y0 = (r.y_mm - top_mm_) * texels_per_mm_, y1 = y0 + r.height_mm * texels_per_mm_;
    for (int y = static_cast<int>(y0); y < std::min<double>(rows_, y1); ++y) {
      for (int x = static_cast<int>(x0); x < std::min<double>(columns_, x1); ++x) {
        const auto part = static_cast<float>(overlap(x0, x1, x) * overlap(y0, y1, y));
        texture_[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(x)] -=
            part * (kPaper - kInk);
      }
    }
  }
}

float BoardRenderer::ink_at(double x_mm, double y_mm) const noexcept {
  const double u = (x_mm - left_mm_) * texels_per_mm_ - 0.5;
  const double v = (y_mm - top_mm_) * texels_per_mm_ - 0.5;
  if (!(u >= 0.0 && v >= 0.0 && u < columns_ - 1 && v < rows_ - 1)) return kTable;
  const auto x = static_cast<std::size_t>(u), y = static_cast<std::size_t>(v);
  const auto a = static_cast<float>(u - static_cast<double>(x)), b = static_cast<float>(v - static_cast<double>(y));
  const float* texel = &texture_[y * static_cast<std::size_t>(columns_) + x];
  const float* below = texel + columns_;
  return (1.0F - b) * ((1.0F - a) * texel[0] + a * texel[1]) + b * ((1.0F - a) * below[0] + a * below[1]);
}

void BoardRenderer::render(const Pose& X_CB, std::uint64_t noise_seed, std::span<std::uint8_t> image) const {
  const std::size_t width = static_cast<std::size_t>(lens_.width);
  std::vector<float> light(image.size(), 0.0F);
  const Vector3d normal_C = X_CB.R.col(2);
  const double distance = normal_C.dot(X_CB.t);
  const Pose X_BC = X_CB.inverse();
  for (std::size_t i = 0; i < ray_x_.size(); ++i) {
    const std::size_t x = i % (kSubsamples * width) / kSubsamples;
    const std::size_t y = i / (kSubsamples * width) / kSubsamples;
    const Vector3d ray(ray_x_[i], ray_y_[i], 1.0);
    const double scale = distance / normal_C.dot(ray);
    float level = kTable;
    if (scale > 0.0) {
      const Vector3d p_B = X_BC * (scale * ray);
      level = ink_at(p_B.x(), p_B.y());
    }
    light[y * width + x] += level / (kSubsamples * kSubsamples);
  }
  blur(light, lens_.width, lens_.height);
  const CounterNoise noise(noise_seed, 0x626f617264);
  for (std::size_t i = 0; i < image.size(); ++i) {
    // The sum of four uniform numbers is as good as normal here.
    const std::uint64_t bits = noise.bits(i);
    float sum = 0.0F;
    for (int k = 0; k < 4; ++k) sum += static_cast<float>((bits >> (16 * k)) & 0xFFFFU) / 65536.0F - 0.5F;
    const float level = light[i] * light_[i] + 6.0F + kNoise * sum * 1.732F;
    image[i] = static_cast<std::uint8_t>(std::clamp(level + 0.5F, 0.0F, 255.0F));
  }
}

}  // namespace perimap

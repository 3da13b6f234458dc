#include "drivers/standins/simulator/view_obstacles.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "core/angle/angle.hpp"
#include "drivers/standins/random/counter_noise.hpp"
#include "drivers/standins/simulator/view_drawing.hpp"

namespace perimap {
namespace {

constexpr std::uint64_t kStream = 0x6f627374;
constexpr double kPeriod_s = 6.0;
constexpr double kComes_s = 2.0, kGoes_s = 5.0;  // within the period

}  // namespace

ViewObstacles::ViewObstacles(std::uint64_t seed, int width, int height, bool instrument, int glints, double smoke)
    : seed_(seed),
      width_(width),
      height_(height),
      instrument_(instrument),
      glints_(glints),
      smoke_(smoke),
      half_width_px_(0.04 * width) {}

ViewObstacles::Shaft ViewObstacles::shaft(double t_s) const noexcept {
  if (!instrument_ || t_s < 0.0) return {};
  const double number = std::floor(t_s / kPeriod_s);
  const double within = t_s - number * kPeriod_s;
  if (within < kComes_s || within > kGoes_s) return {};
  const CounterNoise noise(seed_, kStream);
  const auto index = 4 * static_cast<std::uint64_t>(number);
  const double angle = noise.uniform(index, 0.0, kTwoPi);
  const Vector2d middle(0.5 * width_, 0.5 * height_);
  const double reach = 0.5 * std::hypot(width_, height_) + 2.0 * half_width_px_;
  const Vector2d aim =
      middle + Vector2d(noise.uniform(index + 1, -0.2, 0.2) * width_, noise.uniform(index + 2, -0.2, 0.2) * height_);
  Shaft shaft;
  shaft.is_in_view = true;
  shaft.from = middle + reach * Vector2d(std::cos(angle), std::sin(angle));
  // In and out within 0.4 s each, at work between.
  constexpr double kInOut_s = 0.4;
  const double in = std::clamp(std::min(within - kComes_s, kGoes_s - within) / kInOut_s, 0.0, 1.0);
  const double share = in * in * (3.0 - 2.0 * in);
  const Vector2d work(0.03 * width_ * std::sin(kTwoPi * 0.9 * t_s), 0.03 * width_ * std::cos(kTwoPi * 0.7 * t_s));
  shaft.tip = shaft.from + (0.02 + 0.98 * share) * (aim + work - shaft.from);
  return shaft;
}

bool ViewObstacles::instrument_covers(const Vector2d& px, Duration since_start, double margin_px) const noexcept {
  const Shaft now = shaft(to_seconds(since_start));
  if (!now.is_in_view) return false;
  return ShaftPlace{now.from, now.tip, half_width_px_}.covers(px, margin_px);
}

void ViewObstacles::draw(Duration since_start, std::span<float> radiance) const {
  const double t_s = to_seconds(since_start);
  draw_glints(t_s, radiance);
  draw_shaft(t_s, radiance);
  draw_smoke(t_s, radiance);
}

void ViewObstacles::draw_shaft(double t_s, std::span<float> radiance) const {
  const Shaft now = shaft(t_s);
  if (now.is_in_view) ViewDrawing(width_, height_).shaft({now.from, now.tip, half_width_px_}, radiance);
}

void ViewObstacles::draw_glints(double t_s, std::span<float> radiance) const {
  const CounterNoise noise(seed_, kStream + 1);
  for (int glint = 0; glint < glints_; ++glint) {
    const auto index = 8 * static_cast<std::uint64_t>(glint);
    const double rate_hz = noise.uniform(index, 0.3, 1.2);
    const double phase = noise.uniform(index + 1, 0.0, kTwoPi);
    const double light = std::sin(kTwoPi * rate_hz * t_s + phase);
    if (light < 0.0) continue;
    const double wander_px = 0.02 * width_;
    const Vector2d middle(
        noise.uniform(index + 2, 0.1, 0.9) * width_ + wander_px * std::sin(kTwoPi * 0.5 * t_s + phase),
        noise.uniform(index + 3, 0.1, 0.9) * height_ + wander_px * std::cos(1.9 * t_s + 2.0 * phase));
    const double radius_px = noise.uniform(index + 4, 0.003, 0.009) * width_;
    const double stretch = noise.uniform(index + 5, 1.0, 2.5);
    const int reach = static_cast<int>(std::ceil(2.0 * stretch * radius_px));
    const int u = static_cast<int>(middle.x()), v = static_cast<int>(middle.y());
    for (int row = std::max(0, v - reach); row <= std::min(height_ - 1, v + reach); ++row) {
      for (int column = std::max(0, u - reach); column <= std::min(width_ - 1, u + reach); ++column) {
        const double x = (column - middle.x()) / (stretch * radius_px), y = (row - middle.y()) / radius_px;
        radiance[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(column)] +=
            static_cast<float>(500.0 * light * std::exp(-1.5 * (x * x + y * y)));
      }
    }
  }
}

void ViewObstacles::draw_smoke(double t_s, std::span<float> radiance) const {
  constexpr double kSmokePeriod_s = 8.0, kSmoke_s = 5.0;
  const double within = t_s - std::floor(t_s / kSmokePeriod_s) * kSmokePeriod_s;
  if (!(smoke_ > 0.0) || t_s < 0.0 || within > kSmoke_s) return;
  const double strength = smoke_ * std::pow(std::sin(std::numbers::pi * within / kSmoke_s), 2.0);
  ViewDrawing(width_, height_).clouds(seed_, strength, t_s, radiance);
}

}  // namespace perimap

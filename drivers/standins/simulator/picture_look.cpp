#include "drivers/standins/simulator/picture_look.hpp"

#include <cmath>

#include "core/angle/angle.hpp"
#include "drivers/standins/random/counter_noise.hpp"
#include "drivers/standins/simulator/epicardium.hpp"

namespace perimap {
namespace {

constexpr std::uint64_t kLightStream = 0x6c69676874;

PictureLook rendered() noexcept {
  PictureLook look{};
  look.tissue = tissue_at;
  look.white_grey = 300.0F;
  look.even_light = 0.6F;
  look.bumpy_light = 0.4F;
  look.film = {1.1F, 1200.0F};
  look.tissue_below = {0.10F, 90.0F};
  look.off_mirror_most = 0.08F;
  look.vignetting = 6.0;  // cos^4, and the cone of the light on top of it
  look.blur_side = 0.11F;
  look.exposure_deviation = 0.004;
  look.read_variance = 0.49F;
  look.shot_levels = 150.0F;
  return look;
}

PictureLook of_tissue() noexcept {
  PictureLook look = rendered();
  look.tissue = epicardium_at;
  look.white_grey = 410.0F;
  look.even_light = 0.5F;
  look.bumpy_light = 0.5F;
  look.film = {0.45F, 800.0F};
  look.tissue_below = {0.14F, 35.0F};
  look.off_mirror_most = 0.15F;
  look.film_flows = true;
  look.vignetting = 8.0;
  look.blur_side = 0.25F;
  look.exposure_deviation = 0.006;
  look.read_variance = 0.45F;
  look.shot_levels = 90.0F;
  return look;
}

}  // namespace

PictureLook picture_look(Look look) noexcept { return look == Look::kTissue ? of_tissue() : rendered(); }

FrameLight frame_light(Look look, std::uint64_t seed, Duration since_start) noexcept {
  FrameLight light;
  if (look == Look::kRendered) return light;
  const CounterNoise noise(seed, kLightStream);
  const double t_s = to_seconds(since_start);
  const auto wave = [&](std::uint64_t index, double period_s) {
    const double period = period_s * noise.uniform(2 * index, 0.8, 1.25);
    return std::sin(kTwoPi * (t_s / period + noise.uniform(2 * index + 1)));
  };
  constexpr double kFlow = 0.012;  // 2 mm of the heart's surface
  light.film.x() = static_cast<float>(kFlow * (wave(0, 5.0) + 0.4 * wave(1, 1.7)));
  light.film.y() = static_cast<float>(kFlow * (wave(2, 6.1) + 0.4 * wave(3, 1.3)));
  light.gain = static_cast<float>(1.0 + 0.03 * wave(4, 4.3) + 0.01 * wave(5, 0.9));
  light.veil = static_cast<float>(1.5 + 1.0 * wave(6, 3.7));
  return light;
}

}  // namespace perimap

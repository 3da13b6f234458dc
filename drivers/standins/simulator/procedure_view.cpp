#include "drivers/standins/simulator/procedure_view.hpp"

#include <cmath>

#include "core/angle/angle.hpp"
#include "drivers/standins/random/counter_noise.hpp"

namespace perimap {
namespace {

constexpr std::uint64_t kShaftStream = 0x7368616674;

}  // namespace

ProcedureView::ProcedureView(std::uint64_t seed, const Pose& X_WV, int width, int height) noexcept
    : seed_(seed), X_WV_(X_WV), width_(width), height_(height), drawing_(width, height) {}

// Where what touches has its tip is told by the organ; where what is merely seen works, is drawn.
ShaftPlace ProcedureView::shaft_place(const PictureState::Shaft& shaft, const Shot& shot) const noexcept {
  const CounterNoise noise(seed_, kShaftStream);
  const std::uint64_t index = 4 * shaft.number;
  const double t_s = to_seconds(shot.since);
  ShaftPlace place;
  place.half_width_px = 0.04 * width_;
  const Vector2d middle(0.5 * width_, 0.5 * height_);
  const double angle = noise.uniform(index, 0.0, kTwoPi);
  const double reach = 0.5 * std::hypot(width_, height_) + 2.0 * place.half_width_px;
  place.from = middle + reach * Vector2d(std::cos(angle), std::sin(angle));
  Vector2d aim =
      middle + Vector2d(noise.uniform(index + 1, -0.2, 0.2) * width_, noise.uniform(index + 2, -0.2, 0.2) * height_);
  aim += 0.03 * width_ * Vector2d(std::sin(kTwoPi * 0.9 * t_s), std::cos(kTwoPi * 0.7 * t_s));
  if (shaft.touches) {
    const Vector3d p_C =
        shot.X_WC.inverse() * (X_WV_ * Vector3d(shaft.place_mm.x(), shaft.place_mm.y(), shaft.in * shaft.depth_mm));
    if (p_C.z() > 1.0) aim = shot.lens.project(p_C);
  }
  place.tip = place.from + (0.02 + 0.98 * shaft.in) * (aim - place.from);
  return place;
}

void ProcedureView::draw(const PictureState& state, const Shot& shot, std::vector<float>& scratch,
                         std::span<float> radiance) const {
  const double t_s = to_seconds(shot.since);
  // From the organ to the sensor.
  for (const PictureState::Shaft& shaft : state.shafts) {
    if (shaft.in > 0.0) drawing_.shaft(shaft_place(shaft, shot), radiance);
  }
  if (state.smoke > 0.0) drawing_.clouds(seed_, state.smoke, t_s, radiance);
  if (state.trocar > 0.0) drawing_.trocar(state.trocar, radiance);
  if (state.cloth > 0.0) drawing_.cloth(state.cloth, t_s, radiance);
  if (state.fog > 0.0) drawing_.fog(state.fog, scratch, radiance);
  for (const PictureState::Drop& drop : state.blood) drawing_.blood(seed_ + drop.number, drop.share, radiance);
  if (state.bands_levels > 0.0) drawing_.bands(seed_ + shot.picture, state.bands_levels, radiance);
}

}  // namespace perimap

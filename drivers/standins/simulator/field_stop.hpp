// The dark surround that a scope's field stop leaves of the picture.
#pragma once

#include <cstdint>

#include "core/geometry/pose.hpp"

namespace perimap {

// How an angled scope is held in its camera head: where its field stop's notch is, from x (right) towards y (down), and
// how much larger the zoom makes the picture.
struct ScopeHeld {
  double notch_rad = 0.0;
  double zoom = 1.0;
};

// A round of the picture, with a notch that points where the scope's side is.
struct FieldStop {
  Vector2d centre_px = Vector2d::Zero();
  double radius_px = 0.0;  // 0: there is none
  double notch_rad = 0.0;  // direction of the notch from the centre, from x (right) towards y (down)
  double notch_depth_px = 0.0;
  double notch_width_px = 0.0;  // where it leaves the circle

  // How much light passes there: 1 inside, 0 outside, between over a pixel and a half.
  [[nodiscard]] double passed(const Vector2d& px) const noexcept;
};

// A little off the middle, as they are; its size (at a zoom of 1) and place are drawn.
[[nodiscard]] FieldStop drawn_field_stop(std::uint64_t setup_seed, int width_px, int height_px,
                                         const ScopeHeld& held) noexcept;

}  // namespace perimap

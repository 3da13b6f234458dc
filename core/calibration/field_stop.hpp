// A scope's field stop in the picture: the circle that it leaves of it, and the notch that tells how far the scope is
// turned in its camera head.
#pragma once

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"

namespace perimap {

struct FieldStopReading {
  Vector2d centre_px = Vector2d::Zero();
  double radius_px = 0.0;
  double edge_level = 0.0;         // grey level at which the picture begins behind the dark surround
  double edge_deviation_px = 0.0;  // of one place of the edge about the circle, along the radius
  // How far the edge is off over an arc as wide as the notch: the variance of its mean over an arc, times that arc
  // (px^2 rad). Places side by side share pixels and what stands behind the stop, which moves the edge by its light.
  double edge_density_px2_rad = 0.0;
  double centre_deviation_px = 0.0;  // standard deviation per axis
  double seen_share = 0.0;           // of the circle, inside the picture
  double notch_rad = 0.0;            // from the centre: from x (right) towards y (down), -pi to pi
  double notch_deviation_rad = 0.0;
  double notch_depth_px = 0.0;  // inwards from the circle
};

// By the edge between the dark surround and the picture: a circle through most of it (random samples of three points,
// then least squares), and the one place where the edge lies further inside. Fails, and says what is missing, when
// there is no dark surround, less than a quarter of a circle, no notch, or two that are alike.
[[nodiscard]] Expected<FieldStopReading> read_field_stop(const GreyImage& picture);

}  // namespace perimap

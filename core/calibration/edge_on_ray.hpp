// Where the picture begins behind the dark surround of a field stop.
#pragma once

#include <optional>

#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"

namespace perimap {

// From the centre; on the way in from `outer_px` to `inner_px`, where the grey level rises above `level`, read between
// pixels. None where the outer end, which is drawn in to the picture's border, is bright already: the circle is cut off
// there. The picture is two pixels wide and high at least. No heap.
[[nodiscard]] std::optional<double> edge_on_ray(const GreyImage& picture, double level, const Vector2d& centre_px,
                                                double angle_rad, double outer_px, double inner_px) noexcept;

}  // namespace perimap

// The field stop's notch in one frame, looked for about where it was: what a whole reading (field_stop.hpp) costs too
// much for.
#pragma once

#include <optional>

#include "core/calibration/field_stop.hpp"
#include "core/calibration/turn_reading.hpp"
#include "core/sensors/grey_image.hpp"

namespace perimap {

// The rotation is as FieldStopReading::notch_rad. Within a fifth of a radian to both sides of `near_rad`, on the circle
// of `stop`. None where the edge does not lie on that circle, or no notch of about the depth of the one in `stop` lies
// whole within the arc: it may be elsewhere. No heap; some 10 000 pixels whatever the picture's size.
[[nodiscard]] std::optional<TurnReading> read_notch_near(const GreyImage& picture, const FieldStopReading& stop,
                                                         double near_rad) noexcept;

}  // namespace perimap

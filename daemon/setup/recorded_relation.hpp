// How two tracked sensors were turned against each other while a recording was made.
#pragma once

#include <string>

#include "core/calibration/fit_by_second_sensor.hpp"
#include "core/error/expected.hpp"

namespace perimap {

// Of the second sensor in the frame of the sensor. Fails when the recording has no second sensor, the two are hardly
// seen together, or they turned against each other meanwhile; errors name the recording.
[[nodiscard]] Expected<HeldRelation> relation_in_recording(const std::string& recording);

}  // namespace perimap

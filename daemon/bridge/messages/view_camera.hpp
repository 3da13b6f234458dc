// The camera as viewers know it.
#pragma once

#include <foxglove_view.h>

#include <string>
#include <vector>

#include "core/geometry/camera_model.hpp"
#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// `time` is UTC, as everywhere in what is exported. Borrows the coefficients, in which it puts the lens's.
[[nodiscard]] foxglove_CameraCalibration borrow_camera_calibration(const CameraModel& lens, Instant time,
                                                                   std::vector<double>& coefficients);

// X_PC maps the child's coordinates to the parent's (mm). Borrows the names.
[[nodiscard]] foxglove_FrameTransform borrow_frame_transform(const Pose& X_PC, Instant time, const std::string& parent,
                                                             const char* child);

[[nodiscard]] foxglove_Pose no_pose() noexcept;  // the identity

}  // namespace perimap

// Tracker poses as foxglove::PoseInFrame, for common viewers.
#pragma once

#include <foxglove.h>

#include <string>

#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// In metres, the schema's unit. Borrows the frame id: it must not outlive it, and must not be freed.
[[nodiscard]] foxglove_PoseInFrame borrow_pose_in_frame(const Pose& X_WS, Instant time, const std::string& frame_id);

}  // namespace perimap

// What a tracker says of one tool, before it is anyone's pose in the world.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "core/geometry/pose.hpp"
#include "core/sensors/tracker_sample.hpp"

namespace perimap {

using TrackerSink = std::function<void(const TrackerSample&)>;
using ToolSink = std::function<void(const ToolSample&)>;

struct ToolReading {
  ToolState state = ToolState::kMissing;
  Pose X_TO;              // the tool O in the tracker's frame T; meaningful with kOk only
  double error_mm = 0.0;  // the device's own figure of how far off it is, RMS; 0: it gives none
};

// From unit quaternion and translation, mm, as a device sends them; none when they are no pose: not finite, a norm off
// by more than 5 %, or farther away than any tracker sees (10 m).
[[nodiscard]] std::optional<Pose> pose_of_device(const Vector3d& t, const double (&wxyz)[4]) noexcept;

// What makes the tracker's frame the one that is published.
struct WorldSettings {
  bool relative_to_reference = false;  // W is the reference tool's frame and not the tracker's
  Pose X_IW;                           // registration: the frame I that is published, from W
};

// The sensor, or another tool, in the published frame. Without a valid reference, when one is asked for, there is no
// pose, and the state is the reference's. The error is what the device says of the two together.
[[nodiscard]] ToolReading in_world(const ToolReading& sensor, const ToolReading& reference,
                                   const WorldSettings& settings) noexcept;

}  // namespace perimap

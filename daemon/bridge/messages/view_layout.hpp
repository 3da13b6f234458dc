// How a viewer arranges what is exported: its panels show nothing of a topic that they have not been told of.
#pragma once

#include <optional>
#include <string>

#include "core/geometry/pose.hpp"

namespace perimap {

// How the three-dimensional panel looks at first, mm in W.
struct ViewAim {
  Vector3d at = Vector3d::Zero();    // the middle of what is looked at
  Vector3d from = Vector3d::Zero();  // where it is looked at from
};

// A layout of Foxglove and Lichtblick, JSON: the picture with the surface over it, the surface in three dimensions, the
// ECG, and the state over time. Without an aim the third looks at the tracker.
[[nodiscard]] std::string view_layout(const std::string& world_frame, const std::optional<ViewAim>& aim = {});

}  // namespace perimap

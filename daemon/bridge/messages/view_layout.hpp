// How a viewer arranges what is exported: its panels show nothing of a topic that they have not been told of.
#pragma once

#include <string>

namespace perimap {

// A layout of Foxglove and Lichtblick, JSON: the picture with the surface over it, the surface in three dimensions, the
// ECG, and the state over time.
[[nodiscard]] std::string view_layout(const std::string& world_frame);

}  // namespace perimap

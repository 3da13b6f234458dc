// Where each feature was in each frame.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "core/geometry/pose.hpp"

namespace perimap {

using Track = std::vector<std::optional<Vector2d>>;  // a place a frame, px; empty where it was not found
using Tracks = std::map<std::uint32_t, Track>;       // by the feature's number

}  // namespace perimap

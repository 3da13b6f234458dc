// How long the surface's mesh may be used.
#pragma once

#include <chrono>

#include "core/time/instant.hpp"

namespace perimap {

// After the newest frame that it knows of. One is made each second, and adopted half a second later: when this has
// passed, some have not come.
inline constexpr Duration kMeshValid = std::chrono::seconds(5);

}  // namespace perimap

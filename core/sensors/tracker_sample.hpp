// One reading of the pose tracker, as it came.
#pragma once

#include <cstdint>

#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"

namespace perimap {

enum class ToolState : std::uint8_t { kOk, kMissing, kOutOfVolume, kDisabled };

struct TrackerSample {
  Instant source_time;  // the tracker's own stamp
  Instant arrival;
  std::uint32_t device_frame = 0;
  ToolState state = ToolState::kMissing;
  Pose X_WS;  // meaningful with kOk only
};

}  // namespace perimap

// One reading of the pose tracker, as it came.
#pragma once

#include <cstddef>
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
  Pose X_WS;              // meaningful with kOk only
  double error_mm = 0.0;  // the device's own figure of how far off this pose is, RMS; 0: it gives none
};

// What the pipeline asks of tools that are tracked beside the sensor: how an angled scope is turned in its camera head,
// and whether what holds the organ has been moved.
enum class ToolRole : std::uint8_t { kSecondSensor, kPatient };
inline constexpr std::size_t kToolRoles = 2;
// A reading of one of them, with the tool's pose X_WO in the place of the sensor's.
struct ToolPose {
  ToolRole role = ToolRole::kSecondSensor;
  TrackerSample sample;
};

// One reading of another tool O that the tracker sees beside the sensor, with the tool's pose X_WO in the place of the
// sensor's.
struct ToolSample : TrackerSample {
  // 0: the patient's reference, whose pose is in the tracker's own frame; then the others as they were asked for.
  std::size_t tool = 0;
};

}  // namespace perimap

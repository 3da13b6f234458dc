// A tracked tool's poses as a recording has them.
#pragma once

#include <string>
#include <vector>

#include "core/calibration/timed_poses.hpp"
#include "core/error/expected.hpp"

namespace perimap {

// The tool that `tracker/pose` is of, by the name that commands give it.
inline constexpr const char* kScopeTool = "scope";

// Whether the recording has that tool, named as below.
[[nodiscard]] Expected<bool> has_recorded_poses(const std::string& recording, const std::string& tool);

// On the tracker's own clock, s; readings without a pose are left out. `tool`: kScopeTool, or the name of another
// tracked tool. Fails when the recording has no such tool, and names those that it has.
[[nodiscard]] Expected<std::vector<TimedPose>> read_recorded_poses(const std::string& recording,
                                                                   const std::string& tool);

}  // namespace perimap

// A further tool that an emulated tracker sees, and how it moves.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/calibration/timed_poses.hpp"
#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"
#include "drivers/standins/emulator/pose_track.hpp"

namespace perimap {

// A place as on a command line: TX TY TZ W X Y Z, mm and unit quaternion.
[[nodiscard]] Expected<Pose> parse_place(const std::vector<double>& given, const std::string& option);

struct EmulatedTool {
  enum class Motion : std::uint8_t { kStill, kSwaying, kPivoting, kTable };

  std::string name;  // NDI: port handle; OpenIGTLink: name
  Motion motion = Motion::kSwaying;
  Pose place;                          // kStill
  Vector3d tip_O_mm{0.0, 0.0, 150.0};  // kPivoting
  std::vector<TimedPose> poses = {};   // kTable; their times count from the emulation's start
};

// NAME=sway, NAME=pivot or NAME=pivot:X,Y,Z (the tip in the tool's frame, mm), NAME=still:TX,TY,TZ,W,X,Y,Z, or
// NAME=FILE with a table of poses in metres (pose_table.hpp). Errors say what is wrong.
[[nodiscard]] Expected<EmulatedTool> parse_emulated_tool(const std::string& text);
// Of an NDI tool's name.
[[nodiscard]] Expected<std::uint16_t> port_handle_of(const std::string& name);
[[nodiscard]] PoseTrack track_of(const EmulatedTool& tool, Instant start);

}  // namespace perimap

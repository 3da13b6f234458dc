// A surface as messages of ROS 2.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/time/instant.hpp"
#include "daemon/bridge/ros2/ros2_types.hpp"
#include "daemon/subscribing/shown_surface.hpp"

namespace perimap {

// How much a surface is worth, as diagnostics tell it.
enum class Ros2Level : std::uint8_t { kOk = 0, kWarning = 1, kError = 2, kStale = 3 };

// In metres of the surface's world frame, stamped with UTC: surfaces with that of their valid_time, the camera with
// that of its capture; with `now_utc` where a surface does not tell UTC. Each message is borrowed until the next call
// of its function. Keeps its memory from one surface to the next. One thread.
class Ros2Messages {
 public:
  // Each feature that may be shown: x, y, z (float32, m), deviation (float32, m, the largest in any direction), id
  // (uint32), state (uint8, of perimap.idl). Without a point where there is nothing to show.
  [[nodiscard]] const Ros2Points& points(const ShownSurface& surface, Instant now_utc);
  // The mesh as a list of triangles that goes by itself when the surface's valid_until has passed; where there is
  // none, it takes the one before away.
  [[nodiscard]] const Ros2Marker& mesh(const ShownSurface& surface, Instant now_utc);
  // The tips of tracked tools as spheres, likewise.
  [[nodiscard]] const Ros2Marker& tools(const ShownSurface& surface, Instant now_utc);
  // From the world frame to the camera's. The surface must have X_WC.
  [[nodiscard]] const Ros2Transforms& transforms(const ShownSurface& surface, Instant now_utc);
  // What may be trusted, and why not, and how far each tracked tool is. `level` and `words` tell more than the surface
  // where it does not come any more.
  // `gone`: names of tools that were told of before, and are not any more.
  [[nodiscard]] const Ros2Diagnostics& diagnostics(const ShownSurface& surface, Ros2Level level, std::string_view words,
                                                   const std::vector<std::string>& gone, Instant now_utc);

 private:
  struct Names {
    std::string frame;
    std::string child = kRos2CameraFrame;
  };
  // Without points: what takes away what was shown.
  Ros2Marker marker(const ShownSurface& surface, Instant now_utc);
  void add_tool_statuses(const ShownSurface& surface, const std::vector<std::string>& gone);
  Ros2Header header(const ShownSurface& surface, Instant on_publishers_clock, Instant now_utc);

  Names names_;
  Ros2Points points_{};
  std::vector<sensor_msgs_msg_dds__PointField_> fields_;
  std::vector<std::uint8_t> bytes_;
  Ros2Marker marker_{};
  std::vector<geometry_msgs_msg_dds__Point_> corners_;
  std::vector<std_msgs_msg_dds__ColorRGBA_> colours_;
  Ros2Marker tools_{};
  std::vector<geometry_msgs_msg_dds__Point_> tips_;
  std::vector<std_msgs_msg_dds__ColorRGBA_> tip_colours_;
  Ros2Transforms transforms_{};
  std::array<geometry_msgs_msg_dds__TransformStamped_, 1> camera_{};
  Ros2Diagnostics diagnostics_{};
  std::vector<diagnostic_msgs_msg_dds__DiagnosticStatus_> statuses_;
  std::vector<diagnostic_msgs_msg_dds__KeyValue_> values_;
  std::vector<std::string> texts_;
  std::vector<std::string> tool_texts_;  // of each its name and its words
};

// What of a tool is told at once when it changes; its distance goes with the next message.
struct Ros2ToolStatus {
  std::string name;
  Ros2Level level = Ros2Level::kError;
  bool touches = false;

  bool operator==(const Ros2ToolStatus&) const = default;
};
[[nodiscard]] std::vector<Ros2ToolStatus> ros2_tools(const ShownSurface& surface);

// ok, warning or error: good, degraded or neither.
[[nodiscard]] Ros2Level ros2_level(const ShownSurface& surface) noexcept;

}  // namespace perimap

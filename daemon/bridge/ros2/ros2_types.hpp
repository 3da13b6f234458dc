// The messages of ROS 2 that are published, and their topics as DDS knows them.
#pragma once

#include <ros2.h>

#include "daemon/dds/topic.hpp"

namespace perimap {

using Ros2Header = std_msgs_msg_dds__Header_;
using Ros2Points = sensor_msgs_msg_dds__PointCloud2_;
using Ros2Marker = visualization_msgs_msg_dds__Marker_;
using Ros2Transforms = tf2_msgs_msg_dds__TFMessage_;
using Ros2Diagnostics = diagnostic_msgs_msg_dds__DiagnosticArray_;

namespace ros2_topics {

// ROS 2 puts rt/ before the names of its topics.
inline constexpr const char* kPoints = "rt/perimap/points";
inline constexpr const char* kMesh = "rt/perimap/mesh";
inline constexpr const char* kTools = "rt/perimap/tools";
inline constexpr const char* kTransforms = "rt/tf";
inline constexpr const char* kDiagnostics = "rt/diagnostics";

}  // namespace ros2_topics

inline constexpr const char* kRos2CameraFrame = "perimap_camera";

}  // namespace perimap

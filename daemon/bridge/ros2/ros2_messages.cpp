#include "daemon/bridge/ros2/ros2_messages.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cstring>

#include "daemon/bridge/live/shown_time.hpp"
#include "daemon/bridge/messages/lent.hpp"
#include "daemon/bridge/messages/view_colours.hpp"
#include "daemon/bridge/messages/view_units.hpp"
#include "daemon/publishing/tool_text.hpp"
#include "daemon/publishing/wire_names.hpp"
#include "daemon/subscribing/any_time.hpp"

namespace perimap {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kLongest_ns = 10 * kSecond_ns;  // whatever a surface says of itself
// sensor_msgs/PointField.
constexpr std::uint8_t kUint8 = 2;
constexpr std::uint8_t kUint32 = 6;
constexpr std::uint8_t kFloat32 = 7;
// visualization_msgs/Marker.
constexpr std::int32_t kSpheres = 7;  // SPHERE_LIST
constexpr std::int32_t kTriangles = 11;
constexpr std::int32_t kAdd = 0;
constexpr std::int32_t kTakeAllAway = 3;

// A point's bytes, as the fields describe them.
struct Point {
  float x, y, z, deviation;
  std::uint32_t id;
  std::uint8_t state;
  std::uint8_t padding[3];
};
static_assert(sizeof(Point) == 24);

const char* const kFieldNames[] = {"x", "y", "z", "deviation", "id", "state"};
constexpr std::uint32_t kFieldOffsets[] = {0, 4, 8, 12, 16, 20};
constexpr std::uint8_t kFieldTypes[] = {kFloat32, kFloat32, kFloat32, kFloat32, kUint32, kUint8};

builtin_interfaces_msg_dds__Time_ stamp_of(Instant utc) {
  const std::int64_t ns = to_ns(utc);
  return {static_cast<std::int32_t>(ns / kSecond_ns), static_cast<std::uint32_t>(ns % kSecond_ns)};
}

geometry_msgs_msg_dds__Point_ in_metres(const std::array<double, 3>& p_mm) {
  const foxglove_Point3 p = metres(p_mm);
  return {p.x, p.y, p.z};
}

std_msgs_msg_dds__ColorRGBA_ to_ros2(const foxglove_Color& c) {
  return {static_cast<float>(c.r), static_cast<float>(c.g), static_cast<float>(c.b), static_cast<float>(c.a)};
}

}  // namespace

std::vector<Ros2ToolStatus> ros2_tools(const ShownSurface& surface) {
  std::vector<Ros2ToolStatus> tools;
  for (const ShownTool& tool : surface.tools) {
    const Ros2Level level = tool.at.state == perimap_TOOL_GOOD       ? Ros2Level::kOk
                            : tool.at.state == perimap_TOOL_DEGRADED ? Ros2Level::kWarning
                                                                     : Ros2Level::kError;
    tools.push_back({tool.name, level, tool.at.touches});
  }
  return tools;
}

Ros2Level ros2_level(const ShownSurface& surface) noexcept {
  if (surface.state == perimap_SURFACE_GOOD) return Ros2Level::kOk;
  return surface.usable() ? Ros2Level::kWarning : Ros2Level::kError;
}

Ros2Header Ros2Messages::header(const ShownSurface& surface, Instant on_publishers_clock, Instant now_utc) {
  constexpr Instant kLast = from_ns(std::int64_t{0x7FFFFFFF} * kSecond_ns);
  names_.frame = surface.frame_id;
  return {stamp_of(utc_of(surface, on_publishers_clock, now_utc, kLast)), lent(names_.frame)};
}

const Ros2Points& Ros2Messages::points(const ShownSurface& surface, Instant now_utc) {
  points_ = {};
  points_.header = header(surface, surface.valid, now_utc);
  fields_.clear();
  for (std::size_t i = 0; i < std::size(kFieldNames); ++i) {
    fields_.push_back({lent(kFieldNames[i]), kFieldOffsets[i], kFieldTypes[i], 1});
  }
  lend(fields_, points_.fields);
  bytes_.resize(surface.features.size() * sizeof(Point));
  for (std::size_t i = 0; i < surface.features.size(); ++i) {
    const ShownFeature& feature = surface.features[i];
    const auto at = in_metres(feature.position_W_mm);
    const Point point{static_cast<float>(at.x),
                      static_cast<float>(at.y),
                      static_cast<float>(at.z),
                      static_cast<float>(feature.deviation_mm * kMetresPerMillimetre),
                      feature.id,
                      static_cast<std::uint8_t>(feature.state),
                      {}};
    std::memcpy(bytes_.data() + i * sizeof point, &point, sizeof point);
  }
  lend(bytes_, points_.data);
  points_.height = 1;
  points_.width = static_cast<std::uint32_t>(surface.features.size());
  points_.is_bigendian = std::endian::native == std::endian::big;
  points_.point_step = sizeof(Point);
  points_.row_step = points_.width * points_.point_step;
  points_.is_dense = true;
  return points_;
}

Ros2Marker Ros2Messages::marker(const ShownSurface& surface, Instant now_utc) {
  Ros2Marker marker{};
  marker.header = header(surface, surface.valid, now_utc);
  marker.ns = lent("perimap");
  marker.action = kTakeAllAway;
  marker.pose.orientation.w = 1.0;
  marker.scale = {1.0, 1.0, 1.0};
  const std::int64_t lifetime_ns =
      std::clamp<std::int64_t>(wrapped_difference(to_ns(surface.valid_until), to_ns(surface.valid)), 1, kLongest_ns);
  marker.lifetime = {static_cast<std::int32_t>(lifetime_ns / kSecond_ns),
                     static_cast<std::uint32_t>(lifetime_ns % kSecond_ns)};
  return marker;
}

const Ros2Marker& Ros2Messages::mesh(const ShownSurface& surface, Instant now_utc) {
  marker_ = marker(surface, now_utc);
  corners_.clear();
  colours_.clear();
  marker_.type = kTriangles;
  if (!surface.mesh.triangles.empty()) marker_.action = kAdd;
  marker_.color = to_ros2(colour_of(surface.state, 0.0));
  for (const auto& triangle : surface.mesh.triangles) {
    for (const std::uint32_t vertex : triangle) {
      corners_.push_back(in_metres(surface.mesh.positions_W_mm[vertex]));
      colours_.push_back(to_ros2(colour_of(surface.state, surface.mesh.deviations_mm[vertex])));
    }
  }
  lend(corners_, marker_.points);
  lend(colours_, marker_.colors);
  return marker_;
}

const Ros2Marker& Ros2Messages::tools(const ShownSurface& surface, Instant now_utc) {
  tools_ = marker(surface, now_utc);
  tips_.clear();
  tip_colours_.clear();
  tools_.type = kSpheres;
  constexpr double kDiameter_m = 0.003;
  tools_.scale = {kDiameter_m, kDiameter_m, kDiameter_m};
  for (const ShownTool& tool : surface.tools) {
    if (!tool.at.tip_known) continue;
    tips_.push_back(in_metres(tool.at.tip_W_mm));
    tip_colours_.push_back(to_ros2(colour_of_tool(tool.at.touches)));
  }
  if (!tips_.empty()) tools_.action = kAdd;
  tools_.color = to_ros2(colour_of_tool(false));
  lend(tips_, tools_.points);
  lend(tip_colours_, tools_.colors);
  return tools_;
}

const Ros2Transforms& Ros2Messages::transforms(const ShownSurface& surface, Instant now_utc) {
  const Eigen::Quaterniond q(surface.X_WC->R);
  const foxglove_Vector3 t = metres(surface.X_WC->t);
  camera_[0] = {
      header(surface, surface.capture, now_utc), lent(names_.child), {{t.x, t.y, t.z}, {q.x(), q.y(), q.z(), q.w()}}};
  transforms_.transforms = {1, 1, camera_.data(), false};
  return transforms_;
}

void Ros2Messages::add_tool_statuses(const ShownSurface& surface, const std::vector<std::string>& gone) {
  tool_texts_.clear();
  std::vector<Ros2Level> levels;
  for (const Ros2ToolStatus& tool : ros2_tools(surface)) levels.push_back(tool.level);
  for (const ShownTool& tool : surface.tools) {
    tool_texts_.push_back(fmt::format("perimap: tool {}", tool.name));
    tool_texts_.push_back(tool_words(tool.name, tool.at));
  }
  for (const std::string& name : gone) {
    levels.push_back(Ros2Level::kStale);
    tool_texts_.push_back(fmt::format("perimap: tool {}", name));
    tool_texts_.push_back(fmt::format("{}: nothing is told of it any more", name));
  }
  for (std::size_t i = 0; i < levels.size(); ++i) {
    diagnostic_msgs_msg_dds__DiagnosticStatus_ status{};
    status.level = static_cast<std::uint8_t>(levels[i]);
    status.name = lent(tool_texts_[2 * i]);
    status.message = lent(tool_texts_[2 * i + 1]);
    status.hardware_id = lent(texts_[1]);
    statuses_.push_back(status);
  }
}

const Ros2Diagnostics& Ros2Messages::diagnostics(const ShownSurface& surface, Ros2Level level, std::string_view words,
                                                 const std::vector<std::string>& gone, Instant now_utc) {
  const auto converged = [](const ShownFeature& feature) { return feature.state == perimap_FEATURE_CONVERGED; };
  diagnostics_ = {};
  diagnostics_.header = header(surface, surface.valid, now_utc);
  texts_ = {std::string(words),
            surface.source,
            std::string(name_of(surface.state)),
            std::string(name_of(surface.reason)),
            surface.remedy,
            fmt::format("{}", surface.features.size()),
            fmt::format("{}", std::count_if(surface.features.begin(), surface.features.end(), converged)),
            surface.why_no_mesh};
  const char* const keys[] = {"state", "reason", "remedy", "features", "converged", "no mesh because"};
  values_.clear();
  for (std::size_t i = 0; i < std::size(keys); ++i) values_.push_back({lent(keys[i]), lent(texts_[i + 2])});
  diagnostic_msgs_msg_dds__DiagnosticStatus_ status{};
  status.level = static_cast<std::uint8_t>(level);
  status.name = lent("perimap: surface");
  status.message = lent(texts_[0]);
  status.hardware_id = lent(texts_[1]);
  lend(values_, status.values);
  statuses_.assign(1, status);
  add_tool_statuses(surface, gone);
  lend(statuses_, diagnostics_.status);
  return diagnostics_;
}

}  // namespace perimap

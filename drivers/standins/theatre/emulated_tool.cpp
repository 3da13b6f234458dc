#include "drivers/standins/theatre/emulated_tool.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "core/sensors/tracker_sample.hpp"
#include "drivers/pose_file/pose_table.hpp"

namespace perimap {
namespace {

constexpr double kRate_hz = 100.0;  // of motions that are made here

std::optional<std::vector<double>> numbers_of(std::string_view text) {
  std::vector<double> numbers;
  for (;;) {
    const std::string_view field = text.substr(0, text.find(','));
    double value = 0.0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error != std::errc{} || end != field.data() + field.size() || !std::isfinite(value)) return std::nullopt;
    numbers.push_back(value);
    if (field.size() == text.size()) return numbers;
    text.remove_prefix(field.size() + 1);
  }
}

}  // namespace

Expected<Pose> parse_place(const std::vector<double>& given, const std::string& option) {
  const Vector3d t_mm(given[0], given[1], given[2]);
  const double wxyz[4] = {given[3], given[4], given[5], given[6]};
  const double norm = std::sqrt(wxyz[0] * wxyz[0] + wxyz[1] * wxyz[1] + wxyz[2] * wxyz[2] + wxyz[3] * wxyz[3]);
  if (!(std::abs(norm - 1.0) < 1e-3)) {
    return fail(fmt::format("{}: expected a rotation W X Y Z of norm 1 within 1e-3, got norm {:g}", option, norm));
  }
  return pose_from_wxyz(t_mm, wxyz);
}

Expected<EmulatedTool> parse_emulated_tool(const std::string& text) {
  const std::size_t equals = text.find('=');
  EmulatedTool tool;
  tool.name = text.substr(0, equals);
  const auto refuse = [&text](const char* expected) {
    return fail(fmt::format("--tool {}: expected {}", text, expected));
  };
  if (equals == std::string::npos || tool.name.empty() || tool.name.size() > 20) {
    return refuse("NAME=MOTION, the name of 1 to 20 characters");
  }
  const std::string motion = text.substr(equals + 1);
  const std::string kind = motion.substr(0, motion.find(':'));
  const std::string given = kind.size() < motion.size() ? motion.substr(kind.size() + 1) : "";
  const auto numbers = numbers_of(given);
  if (motion == "sway") return tool;
  if (kind == "pivot") {
    tool.motion = EmulatedTool::Motion::kPivoting;
    if (motion == kind) return tool;
    if (!numbers || numbers->size() != 3) return refuse("pivot:X,Y,Z, where the tip is in the tool's frame, mm");
    tool.tip_O_mm = Vector3d((*numbers)[0], (*numbers)[1], (*numbers)[2]);
    return tool;
  }
  if (kind == "still") {
    tool.motion = EmulatedTool::Motion::kStill;
    if (!numbers || numbers->size() != 7) return refuse("still:TX,TY,TZ,W,X,Y,Z, mm and unit quaternion");
    return parse_place(*numbers, "--tool " + text).map([&tool](const Pose& place) {
      tool.place = place;
      return std::move(tool);
    });
  }
  auto table = read_pose_table(motion, LengthUnit::kMetre);
  if (!table)
    return fail(fmt::format("--tool {}: neither sway, pivot nor still: {}", tool.name, table.error().message));
  tool.motion = EmulatedTool::Motion::kTable;
  tool.poses = in_order(std::move(table->poses));
  if (tool.poses.empty()) return refuse("a table of poses that holds one");
  return tool;
}

Expected<std::uint16_t> port_handle_of(const std::string& name) {
  std::uint16_t handle = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), handle, 16);
  if (error != std::errc{} || end != name.data() + name.size() || name.size() > 2) {
    return fail(fmt::format("--tool {}: expected a port handle of two hexadecimal digits for an NDI tracker", name));
  }
  return handle;
}

PoseTrack track_of(const EmulatedTool& tool, Instant start) {
  switch (tool.motion) {
    case EmulatedTool::Motion::kStill:
      return PoseTrack::still(start, tool.place);
    case EmulatedTool::Motion::kSwaying:
      return PoseTrack::swaying(start, kRate_hz);
    case EmulatedTool::Motion::kPivoting:
      return PoseTrack::pivoting(start, kRate_hz, tool.tip_O_mm);
    case EmulatedTool::Motion::kTable:
      break;
  }
  std::vector<TrackerSample> samples;
  for (const TimedPose& pose : tool.poses) {
    TrackerSample sample;
    sample.source_time = start + from_seconds(pose.t_s);
    sample.state = ToolState::kOk;
    sample.X_WS = pose.X;
    samples.push_back(sample);
  }
  return PoseTrack::of_samples(samples.front().source_time, samples);
}

}  // namespace perimap

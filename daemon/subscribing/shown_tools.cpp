#include "daemon/subscribing/shown_tools.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string_view>

#include "daemon/subscribing/any_time.hpp"

namespace perimap {
namespace {

// So long a tool that perimapd tells nothing of any more is said to be missing.
constexpr Duration kMissed = std::chrono::seconds(10);

ShownTool shown(const perimap_ToolDistance& told, Instant valid, Instant now, perimap_SurfaceState surface) {
  ShownTool tool;
  tool.name = told.tool;
  if (surface != perimap_SURFACE_GOOD && surface != perimap_SURFACE_DEGRADED) {
    tool.at.refusal = client::ToolRefusal::kPublisher;
    tool.at.reason = perimap_TOOL_REASON_SURFACE;
    return tool;
  }
  tool.at = client::distance_at(told, to_ns(valid), to_ns(now));
  if (surface == perimap_SURFACE_DEGRADED && tool.at.state == perimap_TOOL_GOOD) {
    tool.at.state = perimap_TOOL_DEGRADED;
    tool.at.reason = perimap_TOOL_REASON_SURFACE;
  }
  if (tool.at.refusal != client::ToolRefusal::kNone || !tool.at.tip_known) return tool;
  std::array<double, 3> nearest{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    nearest[axis] = tool.at.tip_W_mm[axis] - tool.at.distance_mm * told.normal_W[axis];
  }
  if (std::isfinite(nearest[0] + nearest[1] + nearest[2])) tool.nearest_W_mm = nearest;
  return tool;
}

}  // namespace

void ShownTools::take(const perimap_ToolDistance& told) {
  const std::string_view name = told.tool;
  const auto known = tools_.find(name);
  if (known != tools_.end()) {
    known->second = told;
    return;
  }
  if (tools_.size() >= kMost) {
    tools_.erase(std::min_element(tools_.begin(), tools_.end(),
                                  [](const auto& a, const auto& b) { return a.second.time_ns < b.second.time_ns; }));
  }
  tools_.emplace(name, told);
}

std::vector<ShownTool> ShownTools::at(Instant valid, Instant now, perimap_SurfaceState surface) const {
  std::vector<ShownTool> tools;
  for (const auto& [name, told] : tools_) {
    if (wrapped_difference(to_ns(now), told.valid_until_ns) > kMissed.count()) continue;
    tools.push_back(shown(told, valid, now, surface));
  }
  return tools;
}

}  // namespace perimap

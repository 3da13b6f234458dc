#include "daemon/publishing/tool_text.hpp"

#include <fmt/format.h>

#include <iterator>
#include <vector>

namespace perimap {
namespace {

std::vector<double> list(const double (&values)[3]) { return {std::begin(values), std::end(values)}; }

}  // namespace

std::string_view tool_state_name(std::uint8_t state) noexcept {
  return state == perimap_TOOL_GOOD ? "good" : state == perimap_TOOL_DEGRADED ? "degraded" : "invalid";
}

std::string_view tool_reason_name(std::uint8_t reason) noexcept {
  switch (reason) {
    case perimap_TOOL_REASON_NONE:
      return "none";
    case perimap_TOOL_REASON_NOT_CALIBRATED:
      return "not_calibrated";
    case perimap_TOOL_REASON_NOT_SEEN:
      return "not_seen";
    case perimap_TOOL_REASON_TOO_OLD:
      return "too_old";
    case perimap_TOOL_REASON_SURFACE:
      return "surface";
    case perimap_TOOL_REASON_NO_SURFACE:
      return "no_surface";
    case perimap_TOOL_REASON_BEYOND_EDGE:
      return "beyond_edge";
    default:
      return "unknown";
  }
}

std::string tool_words(std::string_view name, const client::ToolAtInstant& at) {
  if (at.refusal != client::ToolRefusal::kNone) return fmt::format("{}: {}", name, client::describe(at));
  std::string text = fmt::format("{} {}{:.1f} +- {:.1f} mm, {:+.0f} mm/s", name, at.touches ? "TOUCHES, " : "",
                                 at.distance_mm, at.deviation_mm, at.rate_mm_per_s);
  if (at.state == perimap_TOOL_DEGRADED) text += fmt::format(" ({})", client::describe(at));
  return text;
}

std::string tool_words(const perimap_ToolDistance& tool) {
  return tool_words(tool.tool, client::distance_at(tool, tool.time_ns, tool.time_ns));
}

nlohmann::ordered_json tool_json(const perimap_ToolDistance& tool) {
  nlohmann::ordered_json states = nlohmann::ordered_json::array(), reasons = states;
  for (const std::uint8_t state : tool.states) states.push_back(tool_state_name(state));
  for (const std::uint8_t reason : tool.reasons) reasons.push_back(tool_reason_name(reason));
  return {{"tool", tool.tool},
          {"sample_sequence", tool.sample_sequence},
          {"surface_sequence", tool.surface_sequence},
          {"time_ns", tool.time_ns},
          {"state", tool_state_name(tool.state)},
          {"reason", tool_reason_name(tool.reason)},
          {"touches", tool.touches},
          {"tip_W_mm", list(tool.tip_W_mm)},
          {"distances_mm", list(tool.distances_mm)},
          {"deviations_mm", list(tool.deviations_mm)},
          {"rates_mm_per_s", list(tool.rates_mm_per_s)},
          {"states", std::move(states)},
          {"reasons", std::move(reasons)}};
}

}  // namespace perimap

#include "daemon/publishing/wire_tool.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "core/tool/tool_distance.hpp"
#include "daemon/publishing/wire_states.hpp"
#include "daemon/publishing/wire_text.hpp"

namespace perimap {
namespace {

std::uint8_t to_octet(SurfaceState state) noexcept {
  return state == SurfaceState::kGood       ? perimap_TOOL_GOOD
         : state == SurfaceState::kDegraded ? perimap_TOOL_DEGRADED
                                            : perimap_TOOL_INVALID;
}

std::uint8_t to_octet(ToolDistanceReason reason) noexcept {
  switch (reason) {
    case ToolDistanceReason::kNone:
      break;
    case ToolDistanceReason::kNotCalibrated:
      return perimap_TOOL_REASON_NOT_CALIBRATED;
    case ToolDistanceReason::kNotSeen:
      return perimap_TOOL_REASON_NOT_SEEN;
    case ToolDistanceReason::kTooOld:
      return perimap_TOOL_REASON_TOO_OLD;
    case ToolDistanceReason::kSurface:
      return perimap_TOOL_REASON_SURFACE;
    case ToolDistanceReason::kNoSurface:
      return perimap_TOOL_REASON_NO_SURFACE;
    case ToolDistanceReason::kBeyondEdge:
      return perimap_TOOL_REASON_BEYOND_EDGE;
  }
  return perimap_TOOL_REASON_NONE;
}

}  // namespace

WireTool::WireTool(const Identity& identity, const std::string& tool) {
  copy_text(identity.source, wire_.source);
  copy_text(identity.frame_id, wire_.frame_id);
  copy_text(tool, wire_.tool);
  std::copy(identity.run_id.begin(), identity.run_id.end(), wire_.run_id);
}

const perimap_ToolDistance& WireTool::fill(const ToolDistance& told, const SurfaceRelease& release,
                                           Duration utc_minus_monotonic) noexcept {
  ++wire_.sample_sequence;
  wire_.surface_sequence = release.sample_sequence;
  wire_.release_time_ns = to_ns(release.release_time);
  wire_.release_utc_ns = wire_.release_time_ns + utc_minus_monotonic.count();
  wire_.time_ns = to_ns(release.valid_time);
  wire_.valid_until_ns = to_ns(release.valid_until);
  wire_.surface_state = static_cast<std::uint8_t>(to_wire(release.state));
  wire_.surface_reason = static_cast<std::uint8_t>(to_wire(release.reason));
  wire_.touches = told.touches;
  wire_.tip_known = told.tip_known;
  wire_.last_seen_time_ns = told.last_seen ? to_ns(*told.last_seen) : 0;
  const Matrix3d& P = told.tip.covariance_W_mm2;
  std::array<double, 6> upper = {P(0, 0), P(0, 1), P(0, 2), P(1, 1), P(1, 2), P(2, 2)};
  std::copy_n(told.tip.p_WT_mm.data(), 3, wire_.tip_W_mm);
  std::copy_n(told.tip.velocity_W_mm_per_s.data(), 3, wire_.tip_velocity_W_mm_per_s);
  std::copy(upper.begin(), upper.end(), wire_.tip_covariance_W_mm2);
  if (!told.tip_known) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    std::fill_n(wire_.tip_W_mm, 3, kNone);
    std::fill_n(wire_.tip_velocity_W_mm_per_s, 3, kNone);
    std::fill_n(wire_.tip_covariance_W_mm2, 6, kNone);
  }
  std::copy_n(told.ahead[0].point_W_mm.data(), 3, wire_.nearest_W_mm);
  std::copy_n(told.ahead[0].normal_W.data(), 3, wire_.normal_W);
  for (std::size_t h = 0; h < told.ahead.size(); ++h) {
    const DistanceAhead& ahead = told.ahead[h];
    wire_.states[h] = to_octet(ahead.state);
    wire_.reasons[h] = to_octet(ahead.reason);
    wire_.distances_mm[h] = ahead.distance_mm;
    wire_.deviations_mm[h] = ahead.deviation_mm;
    wire_.rates_mm_per_s[h] = ahead.rate_mm_per_s;
  }
  wire_.state = wire_.states[0];
  wire_.reason = wire_.reasons[0];
  return wire_;
}

}  // namespace perimap

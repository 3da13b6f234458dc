// For navigation software: how far the tip of a tracked tool is from the moving surface, at the instant at which the
// picture is shown. From the newest perimap::ToolDistance of that tool.
//
//   const auto tool = perimap::client::distance_at(*newest, display_time_ns, now_ns);
//   if (tool.refusal == perimap::client::ToolRefusal::kNone) show(tool.distance_mm, tool.deviation_mm, tool.touches);
//   else show(describe(tool));
//
// Needs C++17, the C types that idlc makes of perimap_tool.idl, and nothing else. Units and clocks are those of
// perimap_client.hpp. It keeps nothing and allocates nothing. Whether one publisher is heard is asked before
// (perimap_publisher_watch.hpp).
#pragma once

#include <perimap_tool.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>

namespace perimap::client {

// Why there is no distance.
enum class ToolRefusal : std::uint8_t {
  kNone,
  kPublisher,  // perimapd says that there is none: ToolAtInstant::reason
  kStale,      // now is past the sample's valid_until_ns
  kOtherTime,  // the instant asked for lies before the sample's, or after the last horizon
  kMalformed   // numbers that perimapd does not send
};

struct ToolAtInstant {
  ToolRefusal refusal = ToolRefusal::kMalformed;
  std::uint8_t state = perimap_TOOL_INVALID;       // TOOL_INVALID where it is refused
  std::uint8_t reason = perimap_TOOL_REASON_NONE;  // one of TOOL_REASON_...: why it is not good
  bool touches = false;                            // more likely than not within 0.5 mm of the surface, or in it
  // Not a number where it is refused, so that what nobody knows is never taken for a touch.
  double distance_mm = std::numeric_limits<double>::quiet_NaN();  // signed: positive in front of the surface
  double deviation_mm = std::numeric_limits<double>::quiet_NaN();
  double rate_mm_per_s = std::numeric_limits<double>::quiet_NaN();  // negative while the two approach
  // Where the tip is, whatever the surface is; if the tracker's last word still holds.
  bool tip_known = false;
  std::array<double, 3> tip_W_mm{};
};

namespace detail {

// After the sample's time_ns, as perimap_tool.idl has them.
inline constexpr std::array<std::int64_t, perimap_TOOL_HORIZONS> kToolHorizons_ns = {0, 100'000'000, 300'000'000};
inline constexpr double kTouches_mm = 0.5;

inline bool usable(std::uint8_t state) noexcept { return state == perimap_TOOL_DEGRADED || state == perimap_TOOL_GOOD; }

// Of a sample with another value nothing is used (perimap_tool.idl).
inline bool known_states(const perimap_ToolDistance& tool) noexcept {
  return std::all_of(std::begin(tool.states), std::end(tool.states),
                     [](std::uint8_t state) { return state <= perimap_TOOL_GOOD; });
}

inline bool sound(const perimap_ToolDistance& tool, std::size_t horizon) noexcept {
  return std::isfinite(tool.distances_mm[horizon]) && std::isfinite(tool.deviations_mm[horizon]) &&
         tool.deviations_mm[horizon] >= 0.0 && std::isfinite(tool.rates_mm_per_s[horizon]);
}

inline void take_tip(const perimap_ToolDistance& tool, double ahead_s, ToolAtInstant& out) noexcept {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out.tip_W_mm[axis] = tool.tip_W_mm[axis] + ahead_s * tool.tip_velocity_W_mm_per_s[axis];
    if (!std::isfinite(out.tip_W_mm[axis])) return;
  }
  out.tip_known = true;
}

// Between two horizons: the cubic that has their distances and rates (Hermite), and the deviation straight between.
inline void take_between(const perimap_ToolDistance& tool, std::size_t before, std::size_t after, double length_s,
                         double share, ToolAtInstant& out) noexcept {
  const double s = share, s2 = s * s, s3 = s2 * s;
  const double d0 = tool.distances_mm[before], d1 = tool.distances_mm[after];
  const double r0 = length_s * tool.rates_mm_per_s[before], r1 = length_s * tool.rates_mm_per_s[after];
  out.distance_mm = (2 * s3 - 3 * s2 + 1) * d0 + (s3 - 2 * s2 + s) * r0 + (3 * s2 - 2 * s3) * d1 + (s3 - s2) * r1;
  out.rate_mm_per_s = ((6 * s2 - 6 * s) * (d0 - d1) + (3 * s2 - 4 * s + 1) * r0 + (3 * s2 - 2 * s) * r1) / length_s;
  out.deviation_mm = (1 - s) * tool.deviations_mm[before] + s * tool.deviations_mm[after];
}

}  // namespace detail

// At `time_ns`, from the sample's time_ns to 0.3 s after it; `now_ns`: now. Both on perimapd's clock. Between the
// sample's three instants distance and rate are those of a cubic through them, which between 0.1 and 0.3 s can not have
// all that a heart does; the state is the worse one of the two instants beside it.
inline ToolAtInstant distance_at(const perimap_ToolDistance& tool, std::int64_t time_ns, std::int64_t now_ns) noexcept {
  ToolAtInstant out;
  const auto refuse = [&out](ToolRefusal why) {
    out.refusal = why;
    return out;
  };
  if (now_ns > tool.valid_until_ns) return refuse(ToolRefusal::kStale);
  const auto& horizons = detail::kToolHorizons_ns;
  // The first that is not before the instant. Differences of two times that may be anything do not overflow so.
  std::size_t after = 0;
  const auto ahead_ns =
      static_cast<std::int64_t>(static_cast<std::uint64_t>(time_ns) - static_cast<std::uint64_t>(tool.time_ns));
  if (ahead_ns < 0 || ahead_ns > horizons.back()) return refuse(ToolRefusal::kOtherTime);
  while (horizons[after] < ahead_ns) ++after;
  const std::size_t before = horizons[after] == ahead_ns ? after : after - 1;
  if (!detail::known_states(tool)) return refuse(ToolRefusal::kMalformed);
  if (tool.tip_known) detail::take_tip(tool, static_cast<double>(ahead_ns) / 1e9, out);
  for (const std::size_t horizon : {before, after}) {
    if (!detail::usable(tool.states[horizon])) {
      out.reason = tool.reasons[horizon];
      return refuse(ToolRefusal::kPublisher);
    }
    if (!detail::sound(tool, horizon)) return refuse(ToolRefusal::kMalformed);
  }
  const std::size_t worse = tool.states[after] < tool.states[before] ? after : before;
  if (before == after) {
    out.distance_mm = tool.distances_mm[after];
    out.rate_mm_per_s = tool.rates_mm_per_s[after];
    out.deviation_mm = tool.deviations_mm[after];
  } else {
    const auto length_ns = static_cast<double>(horizons[after] - horizons[before]);
    detail::take_between(tool, before, after, length_ns / 1e9,
                         static_cast<double>(ahead_ns - horizons[before]) / length_ns, out);
    if (!std::isfinite(out.distance_mm) || !std::isfinite(out.rate_mm_per_s)) {
      out.distance_mm = out.deviation_mm = out.rate_mm_per_s = std::numeric_limits<double>::quiet_NaN();
      return refuse(ToolRefusal::kMalformed);
    }
  }
  out.state = tool.states[worse];
  out.reason = tool.reasons[worse];
  out.touches = out.distance_mm <= detail::kTouches_mm;
  return refuse(ToolRefusal::kNone);
}

// For people; never null.
inline const char* describe_tool_reason(std::uint8_t reason) noexcept {
  switch (reason) {
    case perimap_TOOL_REASON_NONE:
      return "known";
    case perimap_TOOL_REASON_NOT_CALIBRATED:
      return "its tip is not calibrated";
    case perimap_TOOL_REASON_NOT_SEEN:
      return "the tracker does not see it";
    case perimap_TOOL_REASON_TOO_OLD:
      return "the tracker says nothing new of it";
    case perimap_TOOL_REASON_SURFACE:
      return "the surface is not good";
    case perimap_TOOL_REASON_NO_SURFACE:
      return "there is no continuous surface";
    case perimap_TOOL_REASON_BEYOND_EDGE:
      return "beside what is known of the surface";
    default:
      return "for a reason that is not known here";
  }
}

inline const char* describe(const ToolAtInstant& tool) noexcept {
  switch (tool.refusal) {
    case ToolRefusal::kNone:
      break;
    case ToolRefusal::kPublisher:
      if (tool.reason != perimap_TOOL_REASON_NONE) break;
      return "for a reason that is not told";
    case ToolRefusal::kStale:
      return "what was told of it is too old";
    case ToolRefusal::kOtherTime:
      return "nothing was told of it for this instant";
    case ToolRefusal::kMalformed:
      return "what was told of it cannot be read";
  }
  return describe_tool_reason(tool.reason);
}

}  // namespace perimap::client

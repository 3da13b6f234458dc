// Parts of what `perimap watch` prints, in words.
#pragma once

#include <numbers>
#include <string>

#include "core/time/instant.hpp"
#include "daemon/evaluation/watch/watch_report.hpp"

namespace perimap {

inline constexpr double kPerMinutePerRadian = 60.0 / (2.0 * std::numbers::pi);  // rad/s to cycles a minute

[[nodiscard]] double rate_hz(const StreamReport& report, ReportKind kind);
// Median, 99th percentile and largest, in ms; "-" of none.
[[nodiscard]] std::string spread_text(const DurationSpread& spread);
[[nodiscard]] std::string features_text(const SurfaceDigest& last);
// Positions are not to be used, for a reason of the publishers'.
[[nodiscard]] bool at_odds(client::Hearing hearing);

}  // namespace perimap

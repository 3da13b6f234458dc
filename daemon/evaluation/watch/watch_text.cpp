#include "daemon/evaluation/watch/watch_text.hpp"

#include <fmt/format.h>

namespace perimap {
namespace {

double in_ms(Duration duration) { return to_seconds(duration) * 1e3; }

}  // namespace

double rate_hz(const StreamReport& report, ReportKind kind) {
  // From the first sample of a watch to its last there is one interval less than there are samples.
  const std::uint64_t intervals =
      kind == ReportKind::kSummary && report.received > 0 ? report.received - 1 : report.received;
  return report.length > Duration(0) ? static_cast<double>(intervals) / to_seconds(report.length) : 0.0;
}

std::string spread_text(const DurationSpread& spread) {
  return spread.count == 0
             ? "-"
             : fmt::format("{:.2f} (p99 {:.2f}, max {:.2f})", in_ms(spread.p50), in_ms(spread.p99), in_ms(spread.max));
}

std::string features_text(const SurfaceDigest& last) {
  std::string text = fmt::format("{} converged, {} converging, {} inconsistent, {} invalid",
                                 last.features[perimap_FEATURE_CONVERGED], last.features[perimap_FEATURE_CONVERGING],
                                 last.features[perimap_FEATURE_INCONSISTENT], last.features[perimap_FEATURE_INVALID]);
  if (last.median_deviation_mm) {
    text += fmt::format(", median deviation {:.2f} mm", *last.median_deviation_mm);
  }
  return text;
}

bool at_odds(client::Hearing hearing) {
  return hearing == client::Hearing::kTwoPublishers || hearing == client::Hearing::kImplausible ||
         hearing == client::Hearing::kAnotherBegan;
}

}  // namespace perimap

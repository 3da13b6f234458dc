// Whether L leaves room for what a frame takes to arrive, and for the budget.
#pragma once

#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"

namespace perimap {

struct LatencyCheck {
  bool told = false;  // enough frames have arrived to tell
  bool too_short = false;
  Duration arrival{0};  // capture to arrival, which 99 % of the frames keep to
};

// Of all frames since the start. A latency that is too short makes updates late, not samples: each is marked so.
[[nodiscard]] inline LatencyCheck check_latency(const PipelineSettings& settings,
                                                const PipelineCounters& counters) noexcept {
  constexpr std::uint64_t kEnoughFrames = 60;
  const LatencyHistogram::Summary delay = counters.camera_delay.summary();
  if (delay.count < kEnoughFrames) return {};
  return {true, delay.p99 + settings.budget > settings.latency, delay.p99};
}

}  // namespace perimap

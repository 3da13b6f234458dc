// Whether L leaves room for what a frame and its pose take to arrive, and for the budget.
#pragma once

#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"

namespace perimap {

struct LatencyCheck {
  bool told = false;  // enough frames and poses have arrived to tell
  bool too_short = false;
  bool by_pose = false;  // the pose is what comes last
  Duration arrival{0};   // capture to arrival of both, which 99 % of the frames keep to
};

// Of all since the start. A frame's pose is there when the first reading after the capture is, which at the worst is
// one interval of the tracker later. A latency that is too short makes updates late, not samples: each is marked so;
// and poses that are not waited for are carried on from the readings before, or missing.
[[nodiscard]] inline LatencyCheck check_latency(const PipelineSettings& settings,
                                                const PipelineCounters& counters) noexcept {
  constexpr std::uint64_t kEnough = 60;
  const LatencyHistogram::Summary frame = counters.camera_delay.summary();
  const LatencyHistogram::Summary reading = counters.tracker_delay.summary();
  const bool frames_told = frame.count >= kEnough;
  const bool poses_told = reading.count >= kEnough;
  const Duration pose = counters.tracker_interval.summary().p50 + reading.p99 - settings.pose.time_offset;
  LatencyCheck check;
  check.told = frames_told && poses_told;
  check.by_pose = poses_told && (!frames_told || pose > frame.p99);
  check.arrival = check.by_pose ? pose : frames_told ? frame.p99 : Duration(0);
  check.too_short = (frames_told || poses_told) && check.arrival + settings.budget > settings.latency;
  return check;
}

}  // namespace perimap

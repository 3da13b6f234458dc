// From the frames' stamps to the instants at which a frame's snapshot is evaluated: pure functions, so that a replay
// has the same instants every time.
#pragma once

#include <array>
#include <cstddef>

#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/shard_snapshot.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// What the workers evaluate after a frame. Of a stream that is not published nothing is asked for.
struct EvaluationPlan {
  // Valid times, see ShardSnapshot: releases of the frames' stream, then instants of the clock's. Only [begin, end) are
  // asked for; the others are zero.
  std::array<Instant, kCovariances> instants{};
  std::size_t begin = 0;
  std::size_t end = 0;
  // Where the camera was at the frames that are released meanwhile; unused ones have number 0.
  std::array<FrameCamera, kCamerasKept> cameras{};
};

// `newest` is the history's newest frame, whose pose is set; its update becomes known at `known`, once it has arrived
// and its pose has.
[[nodiscard]] EvaluationPlan plan_evaluation(const FrameHistory& history, const FrameRecord& newest, Instant known,
                                             const PipelineSettings& settings) noexcept;

// Where the camera was at that frame, and what its lens was then. `camera`: as calibrated.
[[nodiscard]] CameraPlace camera_place(const FrameRecord& frame, const CameraModel& camera) noexcept;

// From frame to frame, as the last two were; at most so long as a snapshot's instants can cover, also where there is
// no frame before, or its stamp is not before this one's.
[[nodiscard]] Duration period_before(const FrameHistory& history, const FrameRecord& frame) noexcept;
inline constexpr Duration kLongestCoveredPeriod = std::chrono::milliseconds(50);

// The oldest frame whose release comes once this frame's update is known: while L is some periods, of frames before it.
[[nodiscard]] std::uint64_t oldest_unreleased(const FrameHistory& history, const FrameRecord& newest, Instant known,
                                              Duration latency) noexcept;

}  // namespace perimap

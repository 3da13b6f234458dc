#include "core/pipeline/evaluation_plan.hpp"

#include <algorithm>
#include <cstdint>

#include "core/pipeline/release_schedule.hpp"

namespace perimap {
namespace {

// A snapshot's instants (see kInstantsCovered) reach over a period of the frames, and so far beyond. With the longest
// period they are 23 ms apart, and a covariance with 8 harmonics of the heart is still near its chord between them.
constexpr Duration kCoveredBeyond = std::chrono::milliseconds(20);
constexpr Duration kReleasesBeyond = std::chrono::milliseconds(10);
static_assert(kMostFramesUnderway + kCamerasBefore < FrameHistory::kHeld);

// The releases that come while this frame's snapshot is the newest. Where L is some periods they are of frames before
// it, where L is less than one also of frames to come, which are expected a period apart.
void plan_releases(const FrameHistory& history, const FrameRecord& newest, std::uint64_t oldest,
                   const PipelineSettings& settings, EvaluationPlan& plan) noexcept {
  const Duration period = period_before(history, newest);
  // So many frames from one to the next that they reach over a period and some time for what comes unevenly.
  constexpr auto kSteps = static_cast<Duration::rep>(kReleasesCovered - 1);
  const auto stride =
      static_cast<std::uint64_t>((period + kReleasesBeyond + kSteps * period - Duration(1)) / (kSteps * period));
  for (std::size_t i = 0; i < kReleasesCovered; ++i) {
    const std::uint64_t index = oldest + i * stride;
    const FrameRecord* record = history.find(std::min(index, newest.index));
    const auto to_come = static_cast<Duration::rep>(index - record->index);
    plan.instants[i] = record->stamp.capture + to_come * period + settings.latency + settings.lead;
  }
}

void tell_cameras(const FrameHistory& history, const FrameRecord& newest, std::uint64_t oldest,
                  const CameraModel& camera, EvaluationPlan& plan) noexcept {
  const std::uint64_t first = oldest - std::min<std::uint64_t>(oldest, kCamerasBefore);
  for (std::size_t i = 0; i < kCamerasKept && first + i <= newest.index; ++i) {
    const FrameRecord* record = history.find(first + i);
    if (record == nullptr) continue;
    plan.cameras[i] = {record->stamp.sequence, camera_place(*record, camera)};
  }
}

// From when this frame can be mapped until the next one should have been: a frame later, and some time for what comes
// unevenly.
void plan_instants(const FrameHistory& history, const FrameRecord& newest, Instant known,
                   const PipelineSettings& settings, EvaluationPlan& plan) noexcept {
  const Instant begin = known + settings.lead;
  const Duration step = (period_before(history, newest) + kCoveredBeyond) / static_cast<int>(kInstantsCovered - 1);
  for (std::size_t i = 0; i < kInstantsCovered; ++i) {
    plan.instants[kReleasesCovered + i] = begin + static_cast<int>(i) * step;
  }
}

}  // namespace

CameraPlace camera_place(const FrameRecord& frame, const CameraModel& camera) noexcept {
  if (!frame.pose.valid()) return {};
  return {true, frame.pose.X_WC, lens_of(frame.picture, camera)};
}

Duration period_before(const FrameHistory& history, const FrameRecord& frame) noexcept {
  const FrameRecord* before = history.find(frame.index - std::min<std::uint64_t>(frame.index, 1));
  const Duration since = frame.stamp.capture - before->stamp.capture;
  return since > Duration(0) ? std::min(since, kLongestCoveredPeriod) : kLongestCoveredPeriod;
}

std::uint64_t oldest_unreleased(const FrameHistory& history, const FrameRecord& newest, Instant known,
                                Duration latency) noexcept {
  std::uint64_t oldest = newest.index;
  while (oldest > 0) {
    const FrameRecord* before = history.find(oldest - 1);
    if (before == nullptr || before->stamp.capture + latency < known) break;
    --oldest;
  }
  return oldest;
}

EvaluationPlan plan_evaluation(const FrameHistory& history, const FrameRecord& newest, Instant known,
                               const PipelineSettings& settings) noexcept {
  const bool on_clock = publishes(settings, ReleaseStream::kClock);
  EvaluationPlan plan;
  plan.begin = settings.frame_stream ? 0 : kReleasesCovered;
  plan.end = on_clock ? kCovariances : kReleasesCovered;
  if (settings.frame_stream) {
    const std::uint64_t oldest = oldest_unreleased(history, newest, known, settings.latency);
    plan_releases(history, newest, oldest, settings, plan);
    tell_cameras(history, newest, oldest, settings.camera, plan);
  }
  if (on_clock) plan_instants(history, newest, known, settings, plan);
  return plan;
}

}  // namespace perimap

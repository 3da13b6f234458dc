#include "daemon/publishing/recent_counts.hpp"

#include <algorithm>

namespace perimap {
namespace {

constexpr Duration kStep = std::chrono::seconds(1);
constexpr auto kMoments = static_cast<std::size_t>(RecentCounts::kWindow / kStep) + 1;

}  // namespace

const LatencyHistogram& stage_histogram(const PipelineCounters& counters, ReleaseStream stream,
                                        perimap_StageKind kind) noexcept {
  switch (kind) {
    case perimap_STAGE_PREDICT_AND_FIND:
      return counters.predict_and_find;
    case perimap_STAGE_PHASE_AND_POSE:
      return counters.phase_and_pose;
    case perimap_STAGE_EVALUATE:
      return counters.evaluate;
    case perimap_STAGE_LEARN:
      return counters.learn;
    case perimap_STAGE_CAPTURE_TO_UPDATE:
      return counters.capture_to_update;
    case perimap_STAGE_RELEASE_TARDINESS:
      return counters.of(stream).release_tardiness;
    case perimap_STAGE_DDS_WRITE:
      return counters.of(stream).dds_write;
    case perimap_STAGE_FRAME:
      break;
  }
  return counters.frame_compute;
}

RecentCounts::RecentCounts() { moments_.reserve(kMoments); }

void RecentCounts::note(const PipelineCounters& counters, Instant now) {
  const std::lock_guard lock(mutex_);
  if (!moments_.empty() && now - moments_.back().time < kStep) return;
  if (moments_.size() < kMoments) {
    moments_.emplace_back();
  } else {
    std::rotate(moments_.begin(), moments_.begin() + 1, moments_.end());
  }
  CountsThen& moment = moments_.back();
  moment.time = now;
  for (const ReleaseStream stream : kReleaseStreams) {
    for (std::size_t i = 0; i < kStatusStages.size(); ++i) {
      moment.stages[index_of(stream)][i] = stage_histogram(counters, stream, kStatusStages[i]).counts();
    }
  }
  for (std::size_t i = 0; i < kStatusSources.size(); ++i) {
    moment.received[i] = (counters.*kStatusSources[i].received).get();
  }
}

std::optional<CountsThen> RecentCounts::then() const {
  const std::lock_guard lock(mutex_);
  if (moments_.empty()) return std::nullopt;
  return moments_.front();
}

}  // namespace perimap

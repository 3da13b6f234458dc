// What the pipeline had counted some seconds ago, so that the status can tell of the last seconds by themselves.
#pragma once

#include <perimap.h>

#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include "core/pipeline/pipeline_counters.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// In the order in which the status has them.
inline constexpr std::array<perimap_StageKind, 8> kStatusStages = {
    perimap_STAGE_PREDICT_AND_FIND,  perimap_STAGE_PHASE_AND_POSE,    perimap_STAGE_EVALUATE,  perimap_STAGE_LEARN,
    perimap_STAGE_CAPTURE_TO_UPDATE, perimap_STAGE_RELEASE_TARDINESS, perimap_STAGE_DDS_WRITE, perimap_STAGE_FRAME};

// What the status of a stream says of a stage.
[[nodiscard]] const LatencyHistogram& stage_histogram(const PipelineCounters& counters, ReleaseStream stream,
                                                      perimap_StageKind kind) noexcept;

struct StatusSource {
  perimap_SourceKind kind;
  Counter PipelineCounters::*received;
};
inline constexpr std::array<StatusSource, 5> kStatusSources = {
    {{perimap_SOURCE_CAMERA, &PipelineCounters::frames_received},
     {perimap_SOURCE_TRACKER, &PipelineCounters::poses_received},
     {perimap_SOURCE_ECG, &PipelineCounters::ecg_samples},
     {perimap_SOURCE_R_TRIGGER, &PipelineCounters::r_triggers},
     {perimap_SOURCE_RESPIRATION, &PipelineCounters::respiration_samples}}};

// The counts at one moment.
struct CountsThen {
  Instant time;
  std::array<std::array<LatencyHistogram::Counts, kStatusStages.size()>, kReleaseStreams.size()> stages{};
  std::array<std::uint64_t, kStatusSources.size()> received{};

  [[nodiscard]] std::uint64_t received_of(perimap_SourceKind kind) const noexcept {
    for (std::size_t i = 0; i < kStatusSources.size(); ++i) {
      if (kStatusSources[i].kind == kind) return received[i];
    }
    return 0;
  }
};

// Not for the real-time path: it locks. The threads that count know nothing of it.
class RecentCounts {
 public:
  static constexpr Duration kWindow = std::chrono::seconds(10);

  RecentCounts();

  // At least once a second. Any thread.
  void note(const PipelineCounters& counters, Instant now);
  // The counts of kWindow ago, to a second; of the first note, when that is not so long ago. Any thread.
  [[nodiscard]] std::optional<CountsThen> then() const;

 private:
  mutable std::mutex mutex_;
  std::vector<CountsThen> moments_;  // a second apart, the oldest first
};

}  // namespace perimap

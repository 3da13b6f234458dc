// The status as its wire type. Not for the real-time path: it allocates.
#pragma once

#include <perimap.h>

#include <array>
#include <cstdint>
#include <vector>

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/setup_watch/setup_belief.hpp"
#include "core/time/instant.hpp"
#include "daemon/publishing/identity.hpp"
#include "daemon/publishing/recent_counts.hpp"

namespace perimap {

struct PipelineSettings;

// What the driver of a device knows beside the counters.
struct SourceLink {
  bool closed = false;
  Duration jitter_p50{0};
  Duration jitter_p99{0};
};

struct RecordingFacts {
  perimap_RecordingState state = perimap_RECORDING_OFF;
  std::uint64_t recorded = 0;
  std::uint64_t frames_not_recorded = 0;
  std::uint64_t other_not_recorded = 0;
};

// What the status says beside the counters.
struct StatusFacts {
  perimap_Privilege realtime_priority = perimap_PRIVILEGE_NOT_REQUESTED;
  perimap_Privilege memory_locked = perimap_PRIVILEGE_NOT_REQUESTED;
  Duration latency{0};
  Duration stalled_after{0};  // a source that is silent for longer counts as stalled
  bool sources_ended = false;
  RespirationState respiration = RespirationState::kOff;
  bool respiration_suspected = false;
  RespirationSource respiration_source = RespirationSource::kNone;
  SetupBelief setup;
  RecordingFacts recording;
  PhaseState phase = PhaseState::kUnknown;
  Rhythm rhythm = Rhythm::kUnknown;
  bool latency_short = false;           // see idl/perimap.idl
  bool two_publishers = false;          // likewise
  std::int64_t keys_expire_utc_ns = 0;  // likewise
  bool r_trigger = false;               // R peaks come from a trigger line
  bool ecg_device = true;               // beside the trigger there need be none
  bool respiration_channel = false;     // one is listened to, or a device has one
  // As they are without a device: open, and without jitter.
  SourceLink camera, tracker, ecg, r_trigger_line, respiration_link;
  const RecentCounts* recent = nullptr;  // none: nothing is told of the last seconds
};

// By the places of kStatusSources; a source that is not told of is starting.
using SourceStates = std::array<perimap_SourceState, kStatusSources.size()>;
[[nodiscard]] SourceStates source_states(const PipelineCounters& counters, const StatusFacts& facts,
                                         Instant now) noexcept;

class WireStatus {
 public:
  // Of the identity's stream; but for its releases, what is told is the same of all streams.
  explicit WireStatus(const Identity& identity);
  [[nodiscard]] const perimap_Status& fill(const PipelineCounters& counters, const StatusFacts& facts,
                                           Instant now) noexcept;

 private:
  ReleaseStream stream_;
  perimap_SourceStatus sources_[kStatusSources.size()]{};
  perimap_StageLatency stages_[kStatusStages.size()]{};
  perimap_Status wire_{};
};

// One for each stream that is published.
[[nodiscard]] std::vector<WireStatus> wire_statuses(const Identity& identity, const PipelineSettings& settings);

}  // namespace perimap

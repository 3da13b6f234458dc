// The slower topics as wire types: surface model, phase, status. Not for the real-time path: they allocate.
#pragma once

#include <perimap.h>

#include <array>
#include <span>
#include <string>
#include <vector>

#include "core/periodic/basis.hpp"
#include "core/phase/cardiac_clock.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/shard_snapshot.hpp"
#include "core/pipeline/surface_state.hpp"
#include "daemon/publishing/identity.hpp"
#include "daemon/publishing/recent_counts.hpp"

namespace perimap {

// One moment of the map and its clocks.
struct ModelMoment {
  std::span<const ShardSnapshot* const> snapshots;  // in order of shard
  BasisLayout layout;
  CardiacClock clock;
  RespiratoryClock respiration;
  SurfaceFooting footing;
  Instant now;
  Duration utc_minus_monotonic{0};
  Duration validity{0};  // nothing is said of instants further ahead
};

[[nodiscard]] perimap_RespirationState to_wire(RespirationState state) noexcept;
[[nodiscard]] perimap_RespirationSource to_wire(RespirationSource source) noexcept;

// Owns the buffers that its message points to.
class WireModel {
 public:
  explicit WireModel(const Identity& identity);

  // Valid until the next call.
  [[nodiscard]] const perimap_SurfaceModel& fill(const ModelMoment& moment);

 private:
  void fill_features(const ModelMoment& moment);
  void fill_cycles(const ModelMoment& moment);

  std::vector<perimap_ModelFeature> features_;
  std::vector<std::vector<double>> coefficients_;
  std::vector<perimap_CardiacCycle> cycles_;
  perimap_SurfaceModel wire_{};
};

class WirePhase {
 public:
  explicit WirePhase(const Identity& identity);
  [[nodiscard]] const perimap_Phase& fill(const CardiacClock& clock, Instant now) noexcept;

 private:
  perimap_Phase wire_{};
};

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
  RecordingFacts recording;
  PhaseState phase = PhaseState::kUnknown;
  Rhythm rhythm = Rhythm::kUnknown;
  bool latency_short = false;        // see idl/perimap.idl
  bool r_trigger = false;            // R peaks come from a trigger line
  bool ecg_device = true;            // beside the trigger there need be none
  bool respiration_channel = false;  // one is listened to, or a device has one
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

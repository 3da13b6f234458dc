// All parts of the pipeline, built once and joined; the threads that run them are the daemon's.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <span>
#include <vector>

#include "core/pipeline/batch_starter.hpp"
#include "core/pipeline/feature_finder.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/mapper.hpp"
#include "core/pipeline/phase_cells.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/release_plan.hpp"
#include "core/pipeline/sensor_entrance.hpp"
#include "core/pipeline/shard_snapshot.hpp"
#include "core/pipeline/surface_composer.hpp"
#include "core/pipeline/surface_state.hpp"
#include "core/realtime/worker_team.hpp"

namespace perimap {

class Pipeline {
 public:
  explicit Pipeline(const PipelineSettings& settings);

  [[nodiscard]] const PipelineSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] PipelineCounters& counters() noexcept { return counters_; }
  [[nodiscard]] SensorEntrance& entrance() noexcept { return entrance_; }
  [[nodiscard]] WorkerTeam& team() noexcept { return team_; }
  [[nodiscard]] FeatureFinder& finder() noexcept { return finder_; }
  [[nodiscard]] BatchStarter& starter() noexcept { return starter_; }
  [[nodiscard]] ReleasePlan& plan() noexcept { return plan_; }
  // Every feature with its match of the last frame. For tests, in lockstep: between frames nothing changes them.
  [[nodiscard]] std::span<const FeatureSlot> slots() const noexcept { return slots_; }

  // Mapper thread: takes over what the tracker has sent.
  void drain_poses() noexcept;
  [[nodiscard]] bool pose_reached(Instant t) const noexcept { return mapper_.pose_reached(t); }
  // Mapper thread: one frame through A, B and C, its buffer given back, then D begun.
  void map(const FrameHandle& frame) noexcept;

  // Any thread: a new patient. The mapper forgets the map, the ECG thread the rhythm and the respiration thread the
  // breaths, each when it runs next; counters().maps_forgotten tells when the map is gone.
  void ask_to_forget() noexcept;
  // Mapper thread, between frames.
  void forget_if_asked() noexcept;

  // Before any thread runs: what an earlier run knew. Publishing goes on from it at once, before any source is back.
  void recall(const MapMemory& memory, Instant now);
  // One housekeeping thread: the mapped features, a few at a time, and the breathing.
  [[nodiscard]] MapFeed& map_feed() noexcept { return mapper_.feed(); }

  // Publisher thread: takes over the stamps of the frames that have arrived.
  void drain_stamps(Instant now) noexcept;
  // Publisher thread, each time round: the plan's releases that it is too late for, counted; and what is owed by now.
  void leave_out_missed(Instant now) noexcept;
  // Publisher thread: the surface of one release, with all that is known now. Valid until the next call for its stream.
  [[nodiscard]] const SurfaceSample& compose(const Release& release) noexcept;
  // Publisher thread, after compose(): it was sent, and counts from now on.
  void sent(const SurfaceSample& sample) noexcept;
  // Publisher thread: what was composed last for its stream is not sent, its time has passed. It counts as missed, and
  // its number is given again.
  void take_back(const SurfaceSample& sample) noexcept;

  // Status thread: the clock as it stands, with what the image makes of the running cycle.
  [[nodiscard]] CardiacClock status_clock(Instant now) noexcept;
  // Status thread.
  [[nodiscard]] RespiratoryClock status_respiration() noexcept;
  // Status thread: each worker's newest snapshot, in order of shard; valid until the next call.
  [[nodiscard]] std::span<const ShardSnapshot* const> model_snapshots() noexcept;
  // Status thread: what a surface that is made at `now` of those snapshots and these clocks has to say of itself.
  [[nodiscard]] SurfaceFooting model_footing(const RespiratoryClock& respiration, Instant now) const noexcept;

 private:
  void tell_due() noexcept;

  PipelineSettings settings_;
  PipelineCounters counters_;
  std::vector<FeatureSlot> slots_;
  std::vector<ShardCells> cells_;
  SensorEntrance entrance_;
  WorkerTeam team_;
  FeatureFinder finder_;
  BatchStarter starter_;
  PhaseCells phase_cells_;
  Mapper mapper_;
  ReleasePlan plan_;
  std::array<SurfaceComposer, kReleaseStreams.size()> composers_;  // one a stream
  // Relaxed: a message by itself; the mapper's wake-up follows it.
  std::atomic<bool> forget_asked_{false};
  std::vector<const ShardSnapshot*> publisher_view_;
  std::vector<const ShardSnapshot*> model_view_;
  std::uint64_t model_owes_ = 0;  // the frame whose update the snapshots of model_view_ ought to have
};

}  // namespace perimap

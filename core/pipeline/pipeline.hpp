// All parts of the pipeline, built once and joined; the threads that run them are the daemon's.
#pragma once

#include <memory>
#include <span>

#include "core/time/instant.hpp"

namespace perimap {

class BatchStarter;
class CardiacClock;
class FeatureFinder;
class MapFeed;
class ReleasePlan;
class RespiratoryClock;
class ScopeWatch;
class SensorEntrance;
class SetupWatcher;
class SurfaceMaker;
class WorkerTeam;
struct FeatureSlot;
struct FrameHandle;
struct FrameTrace;
struct MapMemory;
struct PipelineCounters;
struct PipelineSettings;
struct Release;
struct ShardSnapshot;
struct SurfaceFooting;
struct SurfaceSample;

// What it is made of is not seen here: who uses a part includes that part's header, and those who only pass a pipeline
// on compile without any. The parts are made once, so that this costs the real-time path a pointer.
class Pipeline {
 public:
  // Where a trace is given, which must outlive it, the threads write there what became of each frame.
  explicit Pipeline(const PipelineSettings& settings, FrameTrace* trace = nullptr);
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;
  ~Pipeline();

  [[nodiscard]] const PipelineSettings& settings() const noexcept;
  [[nodiscard]] PipelineCounters& counters() noexcept;
  // Null where none is kept.
  [[nodiscard]] FrameTrace* trace() noexcept;
  [[nodiscard]] SensorEntrance& entrance() noexcept;
  [[nodiscard]] WorkerTeam& team() noexcept;
  [[nodiscard]] FeatureFinder& finder() noexcept;
  [[nodiscard]] BatchStarter& starter() noexcept;
  [[nodiscard]] SetupWatcher& setup_watcher() noexcept;
  [[nodiscard]] SurfaceMaker& surface_maker() noexcept;
  // Null where pictures are not asked how the scope is turned.
  [[nodiscard]] ScopeWatch* scope() noexcept;
  [[nodiscard]] ReleasePlan& plan() noexcept;
  // Every feature with its match of the last frame. For tests, in lockstep: between frames nothing changes them.
  [[nodiscard]] std::span<const FeatureSlot> slots() const noexcept;

  // Mapper thread: takes over what the tracker has sent.
  void drain_poses() noexcept;
  [[nodiscard]] bool pose_reached(Instant t) const noexcept;
  // Mapper thread: one frame through A, B and C, the buffer of the one before given back, then D begun.
  void map(const FrameHandle& frame) noexcept;

  // Any thread: a new patient. The mapper forgets the map, the ECG thread the rhythm and the respiration thread the
  // breaths, each when it runs next; counters().maps_forgotten tells when the map is gone.
  void ask_to_forget() noexcept;
  // Mapper thread, between frames.
  void forget_if_asked() noexcept;

  // Any thread: whoever knows says that the organ has been moved. Where the images show it displaced
  // and at rest the mapper moves the map with it when it runs next; counters().maps_moved tells when that is done,
  // moves_refused that it is not.
  void ask_to_move_map() noexcept;
  // Whether what was asked had not begun; then it is not done.
  bool take_back_move() noexcept;
  // Mapper thread, between frames.
  void move_map_if_asked() noexcept;

  // Before any thread runs: what an earlier run knew. Publishing goes on from it at once, before any source is back.
  void recall(const MapMemory& memory, Instant now);
  // One housekeeping thread: the mapped features, a few at a time, and the breathing.
  [[nodiscard]] MapFeed& map_feed() noexcept;

  // Publisher thread: takes over the stamps of the frames that have arrived.
  void drain_stamps(Instant now) noexcept;
  // Publisher thread, each time round: the plan's releases that it is too late for, counted; and what is owed by now.
  void leave_out_missed(Instant now) noexcept;
  // Publisher thread: the surface of one release, with all that is known now. Valid until the next call for its stream.
  [[nodiscard]] const SurfaceSample& compose(const Release& release) noexcept;
  // Publisher thread, after compose(): the clocks that it went by.
  [[nodiscard]] const CardiacClock& composed_heart() const noexcept;
  [[nodiscard]] const RespiratoryClock& composed_breath() const noexcept;
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
  struct Parts;

  std::unique_ptr<Parts> parts_;
};

}  // namespace perimap

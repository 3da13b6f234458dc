// A frame's stages, run by the mapper thread with the help of the workers.
#pragma once

#include <memory>
#include <span>

#include "core/phase/cardiac_clock.hpp"
#include "core/pipeline/batch_starter.hpp"
#include "core/pipeline/feature_finder.hpp"
#include "core/pipeline/feature_intake.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/frame_job.hpp"
#include "core/pipeline/frame_stopwatch.hpp"
#include "core/pipeline/frame_trace.hpp"
#include "core/pipeline/load_shedding.hpp"
#include "core/pipeline/map_bank.hpp"
#include "core/pipeline/map_keeping.hpp"
#include "core/pipeline/map_memory.hpp"
#include "core/pipeline/organ_watch.hpp"
#include "core/pipeline/patch_watch.hpp"
#include "core/pipeline/patient_phases.hpp"
#include "core/pipeline/phase_cells.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/pose_trust.hpp"
#include "core/pipeline/scope_watch.hpp"
#include "core/pipeline/setup_watcher.hpp"
#include "core/pipeline/shard_snapshot.hpp"
#include "core/pipeline/shard_stages.hpp"
#include "core/pipeline/surface_keeper.hpp"
#include "core/realtime/worker_team.hpp"
#include "core/sensors/frame_stamp.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "core/vision/neighbour_motion.hpp"
#include "core/vision/patch_tracker.hpp"

namespace perimap {

// Whom the mapper asks for what takes longer than a frame. All must outlive it.
struct Housekeeping {
  FeatureFinder& finder;
  BatchStarter& starter;
  SetupWatcher& watcher;
  SurfaceMaker& surface_maker;
  ScopeWatch* scope;  // null where pictures are not asked how the scope is turned
};

// Where other threads find what it tells. All must outlive it.
struct MapperOutputs {
  std::span<ShardCells> cells;
  PhaseCells& phase_cells;
  PipelineCounters& counters;
  FrameTrace* trace;  // null where none is kept
};

// One frame: A (workers sweep, predict and find), B (the mapper joins phase and pose), C (workers evaluate), then D
// (workers learn). What is known of the camera, the heart and breathing has a room of its own each, and so has what
// becomes of the features; this class says in which order they take part in a frame.
// All members are called by the mapper thread.
class Mapper {
 public:
  Mapper(const PipelineSettings& settings, std::span<FeatureSlot> slots, WorkerTeam& team,
         const Housekeeping& housekeeping, const MapperOutputs& outputs);

  void add_pose(const TrackerSample& sample) noexcept;
  void add_tool_pose(const ToolPose& pose) noexcept;
  // Before process(): what the respiration channel told until that capture, or later.
  void hear_breath(const BreathSignal& signal, Instant capture) noexcept { phases_.hear(signal, capture); }

  // The tracker has told all about instant t that it will: no need to wait longer.
  [[nodiscard]] bool pose_reached(Instant t) const noexcept { return trust_.reached(t); }

  // Stages A, B and C; then D is begun: the workers learn until the next frame, or whatever else is called here. The
  // images are not used after the return; `before` is the frame processed before, without pixels at first, and `colour`
  // may be without pixels. `ecg`: the ECG's newest clock.
  void process(const FrameStamp& stamp, const GreyImage& image, const GreyImage& before, const ColourImage& colour,
               const CardiacClock& ecg) noexcept;
  // What the mapper does while the workers learn from the frame just processed. In lockstep they have done on return,
  // and so has housekeeping.
  void beside_learning() noexcept;

  // Forgets the patient: every feature, those that are being found too, the breathing, and what the images told of the
  // running cycle and of the heart's law; and publishes that nothing of it is known, with no frame needed for it.
  void forget() noexcept;

  // Whoever knows says that the organ has been moved: where the images show it displaced the map is moved with it, with
  // the motions that are known. False where they do not.
  bool move_map() noexcept;

  // Before the first frame: takes the features of an earlier run, as many as there is room for and whose estimates are
  // of this layout, and what it knew of breathing, carried on to `now`; and publishes them.
  void recall(const MapMemory& memory, Instant now);
  // The mapped features and the breathing, for whoever keeps them.
  [[nodiscard]] MapFeed& feed() noexcept { return keeping_.feed(); }

 private:
  [[nodiscard]] const FrameRecord& begin_frame(const FrameStamp& stamp, const GreyImage& image, const GreyImage& before,
                                               const CardiacClock& ecg) noexcept;
  void take_starts() noexcept;
  void tell_earlier_frames(const PatientPhases::Change& change) noexcept;
  void set_pose(FrameRecord& frame, const GreyImage& image, const GreyImage& before) noexcept;
  void plan_evaluation(const FrameRecord& frame) noexcept;
  void find_features(const FrameRecord& frame) noexcept;
  void hand_on(const FrameRecord& frame, const GreyImage& image, const ColourImage& colour) noexcept;
  void settle_matches(const FrameRecord& frame) noexcept;
  void watch_organ(const FrameRecord& frame) noexcept;
  void tell_displacement() noexcept;
  void follow_organ() noexcept;
  void move_map_with(const RestingOrgan& organ) noexcept;
  void begin_learning(const FrameRecord& frame) noexcept;
  void finish_learning() noexcept;
  void shed_load(bool put_off) noexcept;
  [[nodiscard]] int room() const noexcept;

  PipelineSettings settings_;
  std::span<FeatureSlot> slots_;
  WorkerTeam& team_;
  BatchStarter& starter_;
  SetupWatcher& watcher_;
  PipelineCounters& counters_;

  // What is known at a frame's capture. (What the map leaves unexplained belongs here.)
  PoseTrust trust_;
  PatientPhases phases_;
  OrganWatch organ_;
  PatchWatch patches_;
  std::unique_ptr<FrameHistory> history_;

  // The features, and what is done with them.
  PatchTracker tracker_;
  PatchTracker view_tracker_ = LastView::tracker();
  MapBank bank_;
  FrameJob job_;
  ShardStages stages_;
  NeighbourMotion motion_;
  FeatureIntake intake_;
  MapKeeping keeping_;
  SurfaceKeeper surface_;

  FrameStopwatch stopwatch_;
  LoadSheddingDecision shedding_decision_;
  LoadShedding shedding_;
};

}  // namespace perimap

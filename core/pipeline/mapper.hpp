// A frame's stages, run by the mapper thread with the help of the workers.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/heart_phase.hpp"
#include "core/pipeline/batch_starter.hpp"
#include "core/pipeline/breathing.hpp"
#include "core/pipeline/feature_finder.hpp"
#include "core/pipeline/feature_intake.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/frame_job.hpp"
#include "core/pipeline/image_phase.hpp"
#include "core/pipeline/load_shedding.hpp"
#include "core/pipeline/map_bank.hpp"
#include "core/pipeline/map_keeping.hpp"
#include "core/pipeline/map_memory.hpp"
#include "core/pipeline/parallax.hpp"
#include "core/pipeline/phase_cells.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/pose_history.hpp"
#include "core/pipeline/repeats.hpp"
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

// One frame: A (workers sweep, predict and find), B (the mapper joins phase and pose), C (workers evaluate), then D
// (workers learn). What is known of the camera, the heart and breathing has a room of its own each, and so has what
// becomes of the features; this class says in which order they take part in a frame.
// All members are called by the mapper thread.
class Mapper {
 public:
  Mapper(const PipelineSettings& settings, std::span<FeatureSlot> slots, std::span<ShardCells> cells, WorkerTeam& team,
         FeatureFinder& finder, BatchStarter& starter, SetupWatcher& watcher, SurfaceMaker& surface_maker,
         ScopeWatch* scope, PhaseCells& phase_cells, PipelineCounters& counters);

  void add_pose(const TrackerSample& sample) noexcept;
  // Of the second tracked sensor that tells how the scope is turned.
  void add_second_pose(const TrackerSample& sample) noexcept;
  // Before process(): what the respiration channel told until that capture, or later.
  void hear_breath(const BreathSignal& signal, Instant capture) noexcept { breathing_.hear(signal, capture); }

  // The tracker has told all about instant t that it will: no need to wait longer.
  [[nodiscard]] bool pose_reached(Instant t) const noexcept {
    return poses_.reached(t) && (scope_ == nullptr || scope_->reached(t));
  }

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

  // Before the first frame: takes the features of an earlier run, as many as there is room for and whose estimates are
  // of this layout, and what it knew of breathing, carried on to `now`; and publishes them.
  void recall(const MapMemory& memory, Instant now);
  // The mapped features and the breathing, for whoever keeps them.
  [[nodiscard]] MapFeed& feed() noexcept { return keeping_.feed(); }

 private:
  // When each stage had ended.
  struct StageEnds {
    Instant found;      // A
    Instant settled;    // B
    Instant evaluated;  // C
  };

  [[nodiscard]] const FrameRecord& begin_frame(const FrameStamp& stamp, const GreyImage& image, const GreyImage& before,
                                               const CardiacClock& ecg) noexcept;
  void heed_repeats(const FrameRecord& frame) noexcept;
  void disown_poses(std::uint64_t since_frame) noexcept;
  void set_pose(FrameRecord& frame, const GreyImage& image) noexcept;
  void take_starts() noexcept;
  void tell_earlier_frames(const HeartPhase::Change& heart, const Breathing::Change& breath) noexcept;
  void plan_evaluation(const FrameRecord& frame) noexcept;
  void find_features(const FrameRecord& frame) noexcept;
  void settle_phases(const FrameRecord& frame) noexcept;
  void publish_phases() noexcept;
  void settle_matches(const FrameRecord& frame) noexcept;
  void begin_learning(const FrameRecord& frame) noexcept;
  void finish_learning() noexcept;
  void shed_load(bool put_off) noexcept;
  [[nodiscard]] int room() const noexcept;
  void count(const FrameRecord& frame, Instant begun, const StageEnds& ends) noexcept;

  PipelineSettings settings_;
  PixelModel model_;
  std::span<FeatureSlot> slots_;
  WorkerTeam& team_;
  BatchStarter& starter_;
  SetupWatcher& watcher_;
  ScopeWatch* scope_;  // null where pictures are not asked how the scope is turned
  PhaseCells& phase_cells_;
  PipelineCounters& counters_;

  // What is known at a frame's capture. (What the map leaves unexplained belongs here.)
  PoseHistory poses_;
  HeartPhase heart_;
  Breathing breathing_;
  Parallax parallax_;
  std::unique_ptr<FrameHistory> history_;

  // The features, and what is done with them.
  PatchTracker tracker_;
  PatchTracker view_tracker_ = LastView::tracker();
  MapBank bank_;
  FrameJob job_;
  ShardStages stages_;
  ImagePhase image_phase_;
  NeighbourMotion motion_;
  FeatureIntake intake_;
  MapKeeping keeping_;
  SurfaceKeeper surface_;
  LoadSheddingDecision shedding_decision_;
  LoadShedding shedding_;

  Instant last_capture_;
  Instant last_pose_arrival_;
  std::optional<Pose> last_reading_;  // of the tracker; none where it was not valid
  Repeats pose_repeats_;
  Repeats picture_repeats_;
  Instant learn_started_;
  bool learning_ = false;                 // a frame's D was begun and has not been joined
  Duration computed_before_learning_{0};  // A to C and the rest of the search, of the frame that is being learnt from
};

}  // namespace perimap

// A frame's stages, run by the mapper thread with the help of the workers.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/cycle_posterior.hpp"
#include "core/phase/law_choice.hpp"
#include "core/phase/law_trial.hpp"
#include "core/phase/r_peak_smoother.hpp"
#include "core/phase/respiratory_tracker.hpp"
#include "core/pipeline/batch_starter.hpp"
#include "core/pipeline/feature_finder.hpp"
#include "core/pipeline/feature_group.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/frame_job.hpp"
#include "core/pipeline/image_phase.hpp"
#include "core/pipeline/load_shedding.hpp"
#include "core/pipeline/map_bank.hpp"
#include "core/pipeline/map_feed.hpp"
#include "core/pipeline/map_memory.hpp"
#include "core/pipeline/phase_cells.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/pose_history.hpp"
#include "core/pipeline/shard_snapshot.hpp"
#include "core/realtime/worker_team.hpp"
#include "core/sensors/frame_stamp.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "core/vision/neighbour_motion.hpp"
#include "core/vision/patch_tracker.hpp"

namespace perimap {

// One frame: A (workers sweep, predict and find), B (the mapper joins phase and pose), C (workers evaluate), then D
// (workers learn). The group of eight slots g belongs to worker g mod workers; what is computed for a feature does not
// depend on who computes it.
// All members are called by the mapper thread.
class Mapper {
 public:
  Mapper(const PipelineSettings& settings, std::span<FeatureSlot> slots, std::span<ShardCells> cells, WorkerTeam& team,
         FeatureFinder& finder, BatchStarter& starter, PhaseCells& phase_cells, PipelineCounters& counters);

  void add_pose(const TrackerSample& sample) noexcept;
  // Before process(): what the respiration channel told until that capture, or later.
  void follow_breath(const BreathSignal& signal, Instant capture) noexcept {
    respiration_.track_signal(signal, capture);
  }

  // The tracker has told all about instant t that it will: no need to wait longer.
  [[nodiscard]] bool pose_reached(Instant t) const noexcept { return poses_.reached(t); }

  // Stages A, B and C. The images are not used after the return; `colour` may be without pixels.
  void process(const FrameStamp& stamp, const GreyImage& image, const ColourImage& colour,
               const CardiacClock& newest_clock) noexcept;

  // Stage D of the frame just processed; the workers do it while the mapper waits for the next frame. In lockstep it
  // is done on return.
  void learn() noexcept;

  // Forgets every feature, those that are being found too, the breathing, and what the images told of the running cycle
  // and of the heart's law, and publishes that nothing of it is known, with no frame needed for it.
  void forget() noexcept;

  // Before the first frame: takes the features of an earlier run, as many as there is room for and whose estimates are
  // of this layout, and what it knew of breathing, carried on to `now`; and publishes them.
  void recall(const MapMemory& memory, Instant now);
  // The mapped features and the breathing, for whoever keeps them.
  [[nodiscard]] MapFeed& feed() noexcept { return feed_; }

 private:
  template <void (Mapper::*Stage)(int) noexcept>
  static void run_stage(void* self, int worker) noexcept {
    (static_cast<Mapper*>(self)->*Stage)(worker);
  }
  void predict_shard(int worker) noexcept;
  void find_shard(int worker) noexcept;
  void find_in(FeatureGroup& group, bool scouts) noexcept;
  void plan_evaluation(const FrameRecord& frame, const CardiacClock& clock) noexcept;
  void plan_releases(const FrameRecord& frame) noexcept;
  void plan_instants(const FrameRecord& frame) noexcept;
  [[nodiscard]] Duration period_before(const FrameRecord& frame) const noexcept;
  void evaluate_shard(int worker) noexcept;
  void follow_shard(int worker) noexcept;
  void learn_shard(int worker) noexcept;
  void advance_slot(FeatureGroup& group, std::size_t lane, int worker) noexcept;
  void finish_learning() noexcept;
  void shed_load(bool put_off) noexcept;
  void take_starts() noexcept;
  [[nodiscard]] CardiacClock find_law(const CardiacClock& clock, Instant capture) noexcept;
  void follow_breathing() noexcept;
  void begin_breath() noexcept;
  void expect_displacement(FrameRecord& frame) const noexcept;
  void settle_phases(const FrameRecord& frame) noexcept;
  void settle_cardiac_phase(const ImagePhaseAnswer& seen) noexcept;
  void publish_correction() noexcept;
  void publish_respiration() noexcept;
  void note_motion(const FrameRecord& frame) noexcept;
  void publish_nothing() noexcept;
  void fill_feed() noexcept;
  void adopt_found_features(std::uint64_t frame_index) noexcept;
  void offer_to_finder(const FrameRecord& frame, const GreyImage& image, const ColourImage& colour) noexcept;

  struct alignas(64) WorkerTally {
    std::uint64_t lost_unseen = 0;
    std::uint64_t lost_refused = 0;
    std::uint64_t lost_unstarted = 0;
    std::array<std::uint64_t, kBatchStatuses> starts_failed{};
    std::uint64_t started_anew = 0;
    std::uint64_t adoptions_late = 0;
    bool put_off = false;
    Instant ended;
  };

  PipelineSettings settings_;
  PixelModel model_;
  std::span<FeatureSlot> slots_;
  std::span<ShardCells> cells_;
  WorkerTeam& team_;
  FeatureFinder& finder_;
  BatchStarter& starter_;
  PhaseCells& phase_cells_;
  PipelineCounters& counters_;

  PoseHistory poses_;
  RespiratoryTracker respiration_;
  bool displacement_seen_ = false;
  Vector3d displacement_mm_ = Vector3d::Zero();  // of the surface from the map, as seen last
  Instant displacement_time_;
  RespirationState breath_state_ = RespirationState::kOff;  // until it is corrected: that the frame history tells of
  bool breath_begun_ = false;      // the features that were mapped when it was first found have it
  bool breath_corrected_ = false;  // and have learnt again what was seen before the images had corrected its rate
  std::unique_ptr<FrameHistory> history_;
  PatchTracker tracker_;
  MapBank bank_;
  std::vector<FeatureGroup> groups_;
  LoadSheddingDecision shedding_decision_;
  LoadShedding shedding_;
  ImagePhase image_phase_;
  NeighbourMotion motion_;
  CyclePosterior cycle_;
  RPeakSmoother r_peaks_;  // where completed cycles begin and end, for what is learnt in them
  LawChoice law_;
  std::vector<LawTrial> law_trials_;  // until there are enough
  FrameJob job_;
  std::vector<WorkerTally> tallies_;
  std::vector<Vector2d> occupied_;
  std::uint64_t beats_ = 0;
  std::uint32_t next_id_ = 1;
  Instant last_capture_;
  Instant last_pose_arrival_;
  Instant learn_started_;
  bool learning_ = false;                 // a frame's D was begun and has not been joined
  Duration computed_before_learning_{0};  // A to C and the rest of the search, of the frame that is being learnt from
  MapFeed feed_;
  std::size_t next_fed_slot_ = 0;
};

}  // namespace perimap

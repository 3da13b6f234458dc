// What the workers do in a frame's stages, and what they hand over.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/estimation/measurement_model.hpp"
#include "core/pipeline/batch_starter.hpp"
#include "core/pipeline/feature_group.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_doubts.hpp"
#include "core/pipeline/frame_job.hpp"
#include "core/pipeline/frame_trace.hpp"
#include "core/pipeline/map_bank.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/shard_snapshot.hpp"
#include "core/realtime/worker_team.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// What came of a frame's learning.
struct LearningTally {
  std::uint64_t lost_unseen = 0;
  std::uint64_t lost_refused = 0;
  std::uint64_t lost_unstarted = 0;
  std::array<std::uint64_t, kBatchStatuses> starts_failed{};
  std::uint64_t begun_on_surface = 0;
  std::uint64_t off_surface = 0;
  std::uint64_t started_anew = 0;
  std::uint64_t adoptions_late = 0;
  bool put_off = false;  // some of it, for want of time
  Instant ended;

  void add(const LearningTally& other) noexcept;
};

// The group of eight slots g belongs to worker g mod workers; what is computed for a feature does not depend on who
// computes it. All members are called by the mapper thread; those that run a stage return when all workers have done
// it. The job is read by the workers during stages, and must not change then. Nothing is allocated after construction.
class ShardStages {
 public:
  // Everything must outlive it; `trace` is null where none is kept.
  ShardStages(const PipelineSettings& settings, std::span<FeatureSlot> slots, MapBank& bank,
              std::span<ShardCells> cells, const FrameJob& job, WorkerTeam& team, BatchStarter& starter,
              FrameTrace* trace);

  [[nodiscard]] std::span<FeatureGroup> groups() noexcept { return groups_; }

  // A: features are predicted, and searched for; only the scouts where the job has any.
  void predict_and_find() noexcept { run<&ShardStages::predict_and_find_shard, FramePart::kPredictAndFind>(); }
  // A, after the scouts: the others.
  void find_others() noexcept { run<&ShardStages::find_others_shard, FramePart::kFindOthers>(); }
  // C: the snapshots are evaluated and handed over.
  void evaluate() noexcept { run<&ShardStages::evaluate_shard, FramePart::kEvaluate>(); }
  // After the hand-over: what was not found is searched for again.
  void settle_matches() noexcept { run<&ShardStages::settle_matches_shard, FramePart::kSettleMatches>(); }
  // D: the workers learn until join().
  void begin_learning() noexcept { team_.start(&run_shard<&ShardStages::learn_shard, FramePart::kLearn>, this); }
  // Since the last join(); empty when they have not learnt.
  [[nodiscard]] LearningTally join() noexcept;

  // In the workers' place, while they are at rest; they see it by their next start. That nothing is known:
  void hand_over_nothing() noexcept;
  // What an earlier run had mapped until then, with what is doubted of it:
  void hand_over_recalled(Instant last_capture, const FrameDoubts& doubts) noexcept;

 private:
  template <void (ShardStages::*Stage)(int) noexcept, FramePart part>
  static void run_shard(void* self, int worker) noexcept {
    ShardStages& stages = *static_cast<ShardStages*>(self);
    const FrameSpan span(stages.log_of(worker), part, stages.job_.frame->stamp.sequence);
    (stages.*Stage)(worker);
  }
  template <void (ShardStages::*Stage)(int) noexcept, FramePart part>
  void run() noexcept {
    team_.run(&run_shard<Stage, part>, this);
  }
  [[nodiscard]] FixedLog<FrameSlice>* log_of(int worker) noexcept {
    return trace_ != nullptr ? &trace_->workers[static_cast<std::size_t>(worker)] : nullptr;
  }
  // The groups of one worker.
  template <class Function>
  void for_shard(int worker, Function function) noexcept {
    for (auto g = static_cast<std::size_t>(worker); g < groups_.size(); g += tallies_.size()) function(groups_[g]);
  }

  void predict_and_find_shard(int worker) noexcept;
  void find_others_shard(int worker) noexcept;
  void find_in(FeatureGroup& group, bool scouts) noexcept;
  void evaluate_shard(int worker) noexcept;
  void settle_matches_shard(int worker) noexcept;
  void learn_shard(int worker) noexcept;
  void advance_slot(FeatureGroup& group, std::size_t lane, int worker) noexcept;

  struct alignas(64) WorkerTally {
    LearningTally of;
  };

  const PipelineSettings& settings_;
  PixelModel model_;
  MapBank& bank_;
  std::span<ShardCells> cells_;
  const FrameJob& job_;
  WorkerTeam& team_;
  BatchStarter& starter_;
  FrameTrace* trace_;
  std::vector<FeatureGroup> groups_;
  std::vector<WorkerTally> tallies_;
};

}  // namespace perimap

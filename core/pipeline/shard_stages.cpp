#include "core/pipeline/shard_stages.hpp"

#include <algorithm>

#include "core/pipeline/feature_life.hpp"
#include "core/pipeline/feature_stages.hpp"
#include "core/realtime/realtime_scope.hpp"

namespace perimap {

void LearningTally::add(const LearningTally& other) noexcept {
  lost_unseen += other.lost_unseen;
  lost_refused += other.lost_refused;
  lost_unstarted += other.lost_unstarted;
  for (std::size_t i = 0; i < kBatchStatuses; ++i) starts_failed[i] += other.starts_failed[i];
  begun_on_surface += other.begun_on_surface;
  off_surface += other.off_surface;
  started_anew += other.started_anew;
  adoptions_late += other.adoptions_late;
  put_off = put_off || other.put_off;
  ended = std::max(ended, other.ended);
}

ShardStages::ShardStages(const PipelineSettings& settings, std::span<FeatureSlot> slots, MapBank& bank,
                         std::span<ShardCells> cells, const FrameJob& job, WorkerTeam& team, BatchStarter& starter,
                         FrameTrace* trace)
    : settings_(settings),
      model_{settings.camera},
      bank_(bank),
      cells_(cells),
      job_(job),
      team_(team),
      starter_(starter),
      trace_(trace),
      tallies_(static_cast<std::size_t>(team.size())) {
  for (int g = 0; g < bank.groups(); ++g) {
    const auto first = static_cast<std::size_t>(g) * kLanes;
    groups_.emplace_back(bank, g, slots.subspan(first, std::min<std::size_t>(kLanes, slots.size() - first)));
  }
}

LearningTally ShardStages::join() noexcept {
  team_.join();
  LearningTally sum;
  for (WorkerTally& tally : tallies_) {
    sum.add(tally.of);
    tally = WorkerTally{};
  }
  return sum;
}

void ShardStages::predict_and_find_shard(int worker) noexcept {
  const RealtimeScope realtime;
  for_shard(worker, [this](FeatureGroup& group) {
    group.sweep(job_);
    find_in(group, job_.scouting);
  });
}

void ShardStages::find_others_shard(int worker) noexcept {
  const RealtimeScope realtime;
  for_shard(worker, [this](FeatureGroup& group) { find_in(group, false); });
}

void ShardStages::find_in(FeatureGroup& group, bool scouts) noexcept {
  for (std::size_t lane = 0; lane < group.slots().size(); ++lane) {
    FeatureSlot& slot = group.slots()[lane];
    if (slot.is_scout == scouts) perimap::predict_and_find(slot, group.prediction(lane), job_, model_, settings_);
  }
}

void ShardStages::evaluate_shard(int worker) noexcept {
  const RealtimeScope realtime;
  ShardCells& cells = cells_[static_cast<std::size_t>(worker)];
  for (TripleBuffer<ShardSnapshot>* cell : {&cells.publisher, &cells.model}) {
    ShardSnapshot& snapshot = cell->back();
    snapshot.any = true;
    snapshot.recalled = false;
    snapshot.frame_sequence = job_.frame->stamp.sequence;
    snapshot.capture = job_.frame->stamp.capture;
    snapshot.instants = job_.plan.instants;
    snapshot.cameras = job_.plan.cameras;
    snapshot.camera = camera_place(*job_.frame, settings_.camera);
    snapshot.pose_missing = !job_.frame->pose.valid();
    snapshot.doubts = job_.doubts;
    snapshot.features.clear();
  }
  for_shard(worker, [&](FeatureGroup& group) { group.evaluate(job_, cells.publisher.back(), cells.model.back()); });
  cells.publisher.publish();
  cells.model.publish();
}

void ShardStages::hand_over_nothing() noexcept {
  for (ShardCells& cells : cells_) {
    for (TripleBuffer<ShardSnapshot>* cell : {&cells.publisher, &cells.model}) {
      ShardSnapshot& snapshot = cell->back();
      snapshot.any = false;
      snapshot.features.clear();
      cell->publish();
    }
  }
}

void ShardStages::hand_over_recalled(Instant last_capture, const FrameDoubts& doubts) noexcept {
  for (int worker = 0; worker < team_.size(); ++worker) {
    ShardCells& cells = cells_[static_cast<std::size_t>(worker)];
    for (TripleBuffer<ShardSnapshot>* cell : {&cells.publisher, &cells.model}) {
      ShardSnapshot& snapshot = cell->back();
      snapshot.any = true;
      snapshot.recalled = true;
      snapshot.capture = last_capture;
      snapshot.instants.fill(Instant{});
      snapshot.doubts = doubts;
      snapshot.features.clear();
      for_shard(worker, [&](FeatureGroup& group) {
        for (std::size_t lane = 0; lane < group.slots().size(); ++lane) {
          if (group.slots()[lane].state != SlotState::kMapped) continue;
          FeatureSnapshot& feature = snapshot.features.emplace_back();
          describe(group.slots()[lane], last_capture, doubts, feature);
          bank_.get(group.feature(lane), feature.x);
        }
      });
      cell->publish();
    }
  }
}

void ShardStages::settle_matches_shard(int worker) noexcept {
  const RealtimeScope realtime;
  for_shard(worker, [this](FeatureGroup& group) {
    for (std::size_t lane = 0; lane < group.slots().size(); ++lane) {
      settle_match(group.slots()[lane], group.prediction(lane), job_, model_, settings_);
    }
  });
}

void ShardStages::learn_shard(int worker) noexcept {
  const RealtimeScope realtime;
  LearningTally& tally = tallies_[static_cast<std::size_t>(worker)].of;
  const std::size_t stride = tallies_.size();
  const auto first = static_cast<std::size_t>(worker);
  for_shard(worker, [this](FeatureGroup& group) {
    for (FeatureSlot& slot : group.slots()) hold_match(slot, job_);
  });
  const std::size_t shard = groups_.size() > first ? (groups_.size() - first + stride - 1) / stride : 0;
  for (std::size_t i = 0; i < shard; ++i) {
    if (!settings_.lockstep && MonotonicClock::now() > job_.learn_until) {
      tally.put_off = true;
      break;
    }
    // Each frame begins at another group, so that what is put off is not always the same.
    FeatureGroup& group = groups_[first + stride * ((i + job_.frame->index) % shard)];
    group.learn(model_, settings_.estimator);
    for (std::size_t lane = 0; lane < group.slots().size(); ++lane) advance_slot(group, lane, worker);
  }
  tally.ended = MonotonicClock::now();
}

void ShardStages::advance_slot(FeatureGroup& group, std::size_t lane, int worker) noexcept {
  LearningTally& tally = tallies_[static_cast<std::size_t>(worker)].of;
  const int feature = group.feature(lane);
  FeatureSlot& slot = group.slots()[lane];
  const auto count_failed_start = [&] { ++tally.starts_failed[static_cast<std::size_t>(slot.start.outcome.status)]; };
  switch (advance(slot, bank_, feature, job_, model_, settings_)) {
    case LifeEvent::kNone:
      break;
    case LifeEvent::kStartRequested:
      starter_.request(worker, feature);
      break;
    case LifeEvent::kAdoptionLate:
      ++tally.adoptions_late;
      break;
    case LifeEvent::kBegunOnSurface:
      ++tally.begun_on_surface;
      break;
    case LifeEvent::kOffSurface:
      ++tally.off_surface;
      break;
    case LifeEvent::kStartedAnew:
      ++tally.started_anew;
      break;
    case LifeEvent::kStartFailed:
      count_failed_start();
      break;
    case LifeEvent::kLostUnseen:
      ++tally.lost_unseen;
      break;
    case LifeEvent::kLostRefused:
      ++tally.lost_refused;
      break;
    case LifeEvent::kLostUnstarted:
      count_failed_start();
      ++tally.lost_unstarted;
      break;
  }
}

}  // namespace perimap

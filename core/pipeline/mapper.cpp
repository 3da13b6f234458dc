#include "core/pipeline/mapper.hpp"

#include <algorithm>

#include "core/pipeline/feature_life.hpp"
#include "core/pipeline/feature_stages.hpp"
#include "core/realtime/realtime_scope.hpp"

namespace perimap {

Mapper::Mapper(const PipelineSettings& settings, std::span<FeatureSlot> slots, std::span<ShardCells> cells,
               WorkerTeam& team, FeatureFinder& finder, BatchStarter& starter, CorrectionCells& corrections,
               PipelineCounters& counters)
    : settings_(settings),
      model_{settings.camera},
      slots_(slots),
      cells_(cells),
      team_(team),
      finder_(finder),
      starter_(starter),
      corrections_(corrections),
      counters_(counters),
      poses_(settings.pose),
      history_(std::make_unique<FrameHistory>(settings.estimator.layout)),
      pyramid_(settings.camera.width, settings.camera.height, kPyramidLevels),
      bank_({.layout = settings.estimator.layout, .features = static_cast<int>(slots.size())}),
      tallies_(static_cast<std::size_t>(team.size())) {
  occupied_.reserve(slots.size());
  for (int g = 0; g < bank_.groups(); ++g) {
    const auto first = static_cast<std::size_t>(g) * kLanes;
    groups_.emplace_back(bank_, g, slots.subspan(first, std::min<std::size_t>(kLanes, slots.size() - first)));
  }
}

void Mapper::add_pose(const TrackerSample& sample) noexcept {
  const RealtimeScope realtime;
  if (!poses_.add(sample)) counters_.poses_refused.add();
}

void Mapper::process(const FrameStamp& stamp, const GreyImage& image, const CardiacClock& ecg_clock) noexcept {
  const RealtimeScope realtime;
  finish_learning();
  const Instant begun = MonotonicClock::now();

  if (ecg_clock.beats() != beats_) {
    history_->refresh_phases(ecg_clock);
    beats_ = ecg_clock.beats();
  }
  cycle_.follow(ecg_clock, stamp.capture);
  const CardiacClock clock = ecg_clock.corrected(cycle_.correction());
  FrameRecord& frame = history_->append(stamp);
  frame.pose = poses_.at(stamp.capture);
  if (frame.pose.valid()) frame.X_CW = frame.pose.X_WC.inverse();
  history_->set_phase(frame, clock);
  // Only the ECG completes a cycle. A corrected beginning may lie after a frame of the running one.
  frame.phase.exact = frame.phase.exact && stamp.capture < ecg_clock.anchor();
  job_.frame = &frame;
  job_.history = history_.get();
  job_.pyramid = &pyramid_;
  job_.about_capture = bases_about(settings_.estimator.layout, frame.phase);
  predict_releases(frame, clock);
  adopt_found_features(frame.index);

  pyramid_.build(image);
  team_.run(&run_stage<&Mapper::predict_and_find_shard>, this);
  const Instant found = MonotonicClock::now();
  if (settings_.phase_from_image) settle_phase(frame);
  const Instant joined = MonotonicClock::now();
  team_.run(&run_stage<&Mapper::evaluate_shard>, this);
  const Instant evaluated = MonotonicClock::now();

  offer_to_finder(frame, image);

  counters_.predict_and_find.add(found - begun);
  counters_.phase_and_pose.add(joined - found);
  counters_.evaluate.add(evaluated - joined);
  // In lockstep the capture lies on the recording's clock, not on this machine's.
  if (!settings_.lockstep) counters_.capture_to_update.add(evaluated - stamp.capture);
  counters_.frames.add();
  if (!frame.pose.valid()) counters_.frames_without_pose.add();
  if (frame.pose.valid() && !frame.measurable) counters_.frames_without_phase.add();
}

// B. What the correction changes is the time to come: the publisher evaluates with it, and so does the next frame's A.
void Mapper::settle_phase(const FrameRecord& frame) noexcept {
  ObservedPhase observed;
  switch (image_phase_.observe(groups_, frame, model_, settings_.estimator, observed)) {
    case ImagePhaseOutcome::kObserved:
      cycle_.add(observed);
      counters_.phases_from_image.add();
      break;
    case ImagePhaseOutcome::kContradicts:
      cycle_.add_contradiction();
      break;
    case ImagePhaseOutcome::kCanNotTell:
      break;
  }
  const CycleCorrection correction = cycle_.correction();
  corrections_.publisher.write(correction);
  corrections_.status.write(correction);
}

void Mapper::learn() noexcept {
  const RealtimeScope realtime;
  const Instant capture = job_.frame->stamp.capture;
  // The next frame is expected one period after this one, and needs the budget before its release.
  const Duration period = std::max(capture - last_capture_, Duration(0));
  job_.learn_until = capture + std::min(period, settings_.latency) + settings_.latency - settings_.budget;
  last_capture_ = capture;
  learn_started_ = MonotonicClock::now();
  team_.start(&run_stage<&Mapper::learn_shard>, this);
  if (settings_.lockstep) {
    team_.join();
    starter_.wait_until_done();
  }
}

void Mapper::finish_learning() noexcept {
  team_.join();
  bool put_off = false;
  Instant ended = learn_started_;
  for (WorkerTally& tally : tallies_) {
    counters_.features_lost.add(tally.lost);
    counters_.features_started_anew.add(tally.started_anew);
    counters_.adoptions_late.add(tally.adoptions_late);
    put_off = put_off || tally.put_off;
    ended = std::max(ended, tally.ended);
    tally = WorkerTally{};
  }
  if (put_off) counters_.learning_put_off.add();
  if (ended > learn_started_) counters_.learn.add(ended - learn_started_);
  std::uint64_t tracked = 0;
  std::uint64_t starting = 0;
  std::uint64_t converging = 0;
  std::uint64_t converged = 0;
  std::uint64_t inconsistent = 0;
  for (const FeatureSlot& slot : slots_) {
    if (slot.state == SlotState::kTracked) ++tracked;
    if (slot.state == SlotState::kStarting) ++starting;
    if (slot.state != SlotState::kMapped) continue;
    if (slot.health.state() == HealthState::kInconsistent) {
      ++inconsistent;
    } else if (slot.converged) {
      ++converged;
    } else {
      ++converging;
    }
  }
  counters_.features_tracked.set(tracked);
  counters_.features_starting.set(starting);
  counters_.features_converging.set(converging);
  counters_.features_converged.set(converged);
  counters_.features_inconsistent.set(inconsistent);
}

void Mapper::predict_and_find_shard(int worker) noexcept {
  const RealtimeScope realtime;
  for (auto g = static_cast<std::size_t>(worker); g < groups_.size(); g += tallies_.size()) {
    FeatureGroup& group = groups_[g];
    group.sweep(job_);
    for (std::size_t lane = 0; lane < group.slots().size(); ++lane) {
      predict_and_find(group.slots()[lane], group.prediction(lane), job_, model_, settings_);
    }
  }
}

void Mapper::predict_releases(const FrameRecord& frame, const CardiacClock& clock) noexcept {
  for (std::size_t i = 0; i < job_.releases.size(); ++i) {
    const FrameRecord* earlier = history_->find(frame.index - std::min<std::uint64_t>(frame.index, i));
    const PhaseEstimate at_release = clock.at(earlier->stamp.capture + settings_.latency);
    job_.releases[i] = {earlier->stamp.sequence, basis_at(settings_.estimator.layout, at_release.phase_rad)};
  }
}

void Mapper::evaluate_shard(int worker) noexcept {
  const RealtimeScope realtime;
  ShardCells& cells = cells_[static_cast<std::size_t>(worker)];
  for (TripleBuffer<ShardSnapshot>* cell : {&cells.publisher, &cells.model}) {
    ShardSnapshot& snapshot = cell->back();
    snapshot.any = true;
    snapshot.frame_sequence = job_.frame->stamp.sequence;
    snapshot.pose_missing = !job_.frame->pose.valid();
    for (std::size_t i = 0; i < job_.releases.size(); ++i) {
      snapshot.release_sequences[i] = job_.releases[i].frame_sequence;
    }
    snapshot.features.clear();
  }
  for (auto g = static_cast<std::size_t>(worker); g < groups_.size(); g += tallies_.size()) {
    groups_[g].evaluate(job_, cells.publisher.back(), cells.model.back());
  }
  cells.publisher.publish();
  cells.model.publish();
}

void Mapper::learn_shard(int worker) noexcept {
  const RealtimeScope realtime;
  WorkerTally& tally = tallies_[static_cast<std::size_t>(worker)];
  const std::size_t stride = tallies_.size();
  const auto first = static_cast<std::size_t>(worker);
  for (std::size_t g = first; g < groups_.size(); g += stride) {
    for (FeatureSlot& slot : groups_[g].slots()) hold_match(slot, job_);
  }
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

void Mapper::advance_slot(FeatureGroup& group, std::size_t lane, int worker) noexcept {
  WorkerTally& tally = tallies_[static_cast<std::size_t>(worker)];
  const int feature = group.feature(lane);
  switch (advance(group.slots()[lane], bank_, feature, job_, model_, settings_)) {
    case LifeEvent::kNone:
      break;
    case LifeEvent::kStartRequested:
      starter_.request(worker, feature);
      break;
    case LifeEvent::kAdoptionLate:
      ++tally.adoptions_late;
      break;
    case LifeEvent::kStartedAnew:
      ++tally.started_anew;
      break;
    case LifeEvent::kLost:
      ++tally.lost;
      break;
  }
}

void Mapper::adopt_found_features(std::uint64_t frame_index) noexcept {
  auto slot = slots_.begin();
  for (const FoundFeature& found : finder_.adopt(frame_index)) {
    slot = std::find_if(slot, slots_.end(), [](const FeatureSlot& s) { return s.state == SlotState::kEmpty; });
    if (slot == slots_.end()) return;
    slot->state = SlotState::kTracked;
    slot->id = next_id_++;
    slot->first_observed = found.first_observed;
    slot->first_observed_px = found.first_observed_px;
    slot->patch = found.patch;
    slot->patch_state = found.patch_state;
    slot->velocity_px = found.velocity_px;
    slot->last_found_frame = frame_index - 1;
    slot->refused_in_a_row = 0;
    slot->held.clear();
    slot->failed_starts = 0;
    slot->converged = false;
  }
}

void Mapper::offer_to_finder(const FrameRecord& frame, const GreyImage& image) noexcept {
  occupied_.clear();
  int free = 0;
  for (const FeatureSlot& slot : slots_) {
    if (slot.state == SlotState::kEmpty) ++free;
    if (slot.match.state == MatchState::kFound) occupied_.push_back(slot.match.px);
  }
  finder_.offer(frame.index, frame.stamp, image, occupied_, free);
}

}  // namespace perimap

#include "core/pipeline/mapper.hpp"

#include <algorithm>
#include <utility>

#include "core/pipeline/feature_life.hpp"
#include "core/pipeline/feature_stages.hpp"
#include "core/pipeline/start_progress.hpp"
#include "core/realtime/realtime_scope.hpp"

namespace perimap {
namespace {

// Frames from one search for breathing to the next, and, where it is not asked for, from one look at the common
// displacement to the next.
constexpr std::uint64_t kSearchInterval = 32;
constexpr std::uint64_t kDisplacementInterval = 3;
// How well a frame tells the common displacement while the map is young, and how fast breathing changes it.
constexpr double kDisplacementDeviation_mm = 1.0;
constexpr double kDisplacementRate_mm_per_s = 15.0;
// What earlier runs found after the map was last kept was published by ids that are not known: they are not given
// again. Several runs may have gone on from the same memory, one after the other, so that some are left out for each
// second since: more than are ever found in one.
constexpr std::uint32_t kIdsLeftOut = 10'000;
constexpr double kIdsLeftOutPerSecond = 1000.0;
// A snapshot's instants (see kInstantsCovered) reach over a period of the frames, at most so long, and so far beyond.
// At that they are 23 ms apart, and a covariance with 8 harmonics of the heart is still near its chord between them.
constexpr Duration kLongestCoveredPeriod = std::chrono::milliseconds(50);
constexpr Duration kCoveredBeyond = std::chrono::milliseconds(20);
constexpr Duration kReleasesBeyond = std::chrono::milliseconds(10);
static_assert(kMostFramesUnderway + kCamerasBefore < FrameHistory::kHeld);

}  // namespace

Mapper::Mapper(const PipelineSettings& settings, std::span<FeatureSlot> slots, std::span<ShardCells> cells,
               WorkerTeam& team, FeatureFinder& finder, BatchStarter& starter, PhaseCells& phase_cells,
               PipelineCounters& counters)
    : settings_(settings),
      model_{settings.camera},
      slots_(slots),
      cells_(cells),
      team_(team),
      finder_(finder),
      starter_(starter),
      phase_cells_(phase_cells),
      counters_(counters),
      poses_(settings.pose),
      respiration_(settings.respiration),
      history_(std::make_unique<FrameHistory>(settings.estimator.layout)),
      bank_({.layout = settings.estimator.layout, .features = static_cast<int>(slots.size())},
            settings.estimator.precision),
      shedding_decision_(static_cast<int>(slots.size()), settings.budget),
      shedding_(slots),
      motion_(slots.size()),
      cycle_(settings.image_alone),
      tallies_(static_cast<std::size_t>(team.size())) {
  occupied_.reserve(slots.size());
  law_trials_.reserve(slots.size());
  counters_.start_matches_needed.set(static_cast<std::uint64_t>(settings.estimator.start_observations));
  for (int g = 0; g < bank_.groups(); ++g) {
    const auto first = static_cast<std::size_t>(g) * kLanes;
    groups_.emplace_back(bank_, g, slots.subspan(first, std::min<std::size_t>(kLanes, slots.size() - first)));
  }
}

void Mapper::add_pose(const TrackerSample& sample) noexcept {
  const RealtimeScope realtime;
  if (!poses_.add(sample)) counters_.poses_refused.add();
  last_pose_arrival_ = std::max(last_pose_arrival_, sample.arrival);
}

void Mapper::process(const FrameStamp& stamp, const GreyImage& image, const ColourImage& colour,
                     const CardiacClock& newest_clock) noexcept {
  const RealtimeScope realtime;
  finish_learning();
  const Instant begun = MonotonicClock::now();
  CardiacClock ecg_clock = newest_clock.as_of(stamp.arrival);
  take_starts();
  if (settings_.law_from_image) ecg_clock = find_law(ecg_clock, stamp.capture);
  job_.law = ecg_clock.law_belief();

  follow_breathing();
  if (ecg_clock.beats() != beats_) {
    // Under laws that are not ruled out the same phases would tell of other R peaks.
    if (!job_.law.laws().undecided()) r_peaks_.on_beat(ecg_clock);
    history_->refresh_phases(r_peaks_.moved(ecg_clock), respiration_.clock());
    beats_ = ecg_clock.beats();
  }
  cycle_.follow(ecg_clock, stamp.capture);
  const CardiacClock clock = ecg_clock.corrected(cycle_.correction());
  FrameRecord& frame = history_->append(stamp);
  FrameHistory::set_pose(frame, poses_.at(stamp.capture));
  history_->set_phase(frame, clock, respiration_.clock());
  expect_displacement(frame);
  job_.frame = &frame;
  job_.history = history_.get();
  job_.image = image;
  job_.tracker = &tracker_;
  job_.about_capture = bases_about(settings_.estimator.layout, frame.phase, frame.respiration);
  plan_evaluation(frame, clock);
  adopt_found_features(frame.index);

  job_.templates = finder_.templates();
  job_.shift = {};
  job_.scouting = choose_scouts(slots_, frame.index);
  team_.run(&run_stage<&Mapper::predict_shard>, this);
  if (job_.scouting) {
    job_.shift = shift_of_scouts(slots_);
    team_.run(&run_stage<&Mapper::find_shard>, this);
  }
  const Instant found = MonotonicClock::now();
  settle_phases(frame);
  const Instant joined = MonotonicClock::now();
  team_.run(&run_stage<&Mapper::evaluate_shard>, this);
  const Instant evaluated = MonotonicClock::now();
  note_motion(frame);
  team_.run(&run_stage<&Mapper::follow_shard>, this);
  const Instant followed = MonotonicClock::now();

  offer_to_finder(frame, image, colour);
  fill_feed();

  counters_.predict_and_find.add(found - begun);
  counters_.phase_and_pose.add(joined - found);
  counters_.evaluate.add(evaluated - joined);
  computed_before_learning_ = followed - begun;
  // In lockstep the capture lies on the recording's clock, not on this machine's.
  if (!settings_.lockstep) counters_.capture_to_update.add(evaluated - stamp.capture);
  counters_.frames.add();
  if (!frame.pose.valid()) counters_.frames_without_pose.add();
  if (frame.pose.valid() && !frame.measurable) counters_.frames_without_phase.add();
}

// Before this frame's adoptions. In lockstep all starts are ready at their frames.
void Mapper::take_starts() noexcept {
  for (FeatureSlot& slot : slots_) {
    BatchStartExchange& start = slot.start;
    const bool awaited = slot.state == SlotState::kStarting && !start.due && history_->count() >= start.adopt_at_frame;
    // Acquire: pairs with housekeeping's release store, so that the whole outcome is visible.
    if (!awaited || !start.ready.load(std::memory_order_acquire)) continue;
    start.due = true;
    if (start.trial && !slot.forgotten && law_trials_.size() < law_trials_.capacity()) {
      law_trials_.push_back(*start.trial);
    }
  }
}

// The clock under the law that what has been seen is in favour of.
CardiacClock Mapper::find_law(const CardiacClock& clock, Instant capture) noexcept {
  const LawBelief before = law_.belief();
  bool another = false;
  // Not while the images carry the phase on: by the law that it was told by when they began.
  if (law_trials_.size() >= LawChoice::kFewestTrials && clock.at(capture).state == PhaseState::kLocked) {
    another = law_.weigh(law_trials_);
    law_trials_.clear();
  }
  if (clock.beats() != beats_) another = law_.on_beat(clock) || another;
  if (another) {
    for (FeatureGroup& group : groups_) group.doubt();
  }
  const CardiacClock told = clock.with_law(law_.belief());
  if (law_.belief().laws() != before.laws()) {
    r_peaks_.forget();
    history_->retell_phases(told);
  }
  return told;
}

// Until the images have corrected what was found of it.
void Mapper::follow_breathing() noexcept {
  const RespiratoryClock& breath = respiration_.clock();
  if (breath_corrected_) return;
  if (breath.state != breath_state_) {
    breath_state_ = breath.state;
    history_->retell_respiration(breath);
    if (breath.state == RespirationState::kLocked) begin_breath();
  }
  if (breath.state == RespirationState::kLocked && breath.corrected) {
    breath_corrected_ = true;
    history_->retell_respiration(breath);
    if (!history_->tracker_is_exact()) return;
    r_peaks_.forget();
    for (FeatureGroup& group : groups_) group.learn_again();
  }
}

void Mapper::begin_breath() noexcept {
  r_peaks_.forget();
  const bool again = history_->tracker_is_exact();
  for (FeatureGroup& group : groups_) {
    // What was learnt by a phase that has been lost since.
    if (breath_begun_) group.doubt();
    group.begin_breath(respiration_.wave(), again);
  }
  breath_begun_ = true;
  // So many are learnt in a frame, one of which is new.
  if (again) respiration_.map_catches_up_for(history_->span() / (kLearnPerFrame - 1));
}

// What was found is not told as corrected before the map has followed.
void Mapper::publish_respiration() noexcept {
  RespiratoryClock clock = respiration_.clock();
  clock.corrected = clock.corrected && breath_corrected_;
  phase_cells_.publisher_respiration.write(clock);
  phase_cells_.status_respiration.write(clock);
}

// While breathing is not known the surface is expected displaced as it was seen last.
void Mapper::expect_displacement(FrameRecord& frame) const noexcept {
  frame.displacement_deviation_mm = frame.respiration.deviation_mm;
  if (frame.respiration.known || !displacement_seen_) return;
  const double age_s = to_seconds(frame.stamp.capture - displacement_time_);
  const double deviation_mm = kDisplacementDeviation_mm + kDisplacementRate_mm_per_s * age_s;
  if (!(deviation_mm < frame.displacement_deviation_mm)) return;
  frame.displacement_mm = displacement_mm_;
  frame.displacement_deviation_mm = deviation_mm;
}

// Where the features that are believed so far were in the frame before, and are now.
void Mapper::note_motion(const FrameRecord& frame) noexcept {
  motion_.clear();
  for (const FeatureSlot& slot : slots_) {
    const bool in_both = slot.match.state == MatchState::kFound && slot.last_found_frame + 1 == frame.index;
    if (slot.state != SlotState::kEmpty && in_both) motion_.add(slot.patch_state.px, slot.match.px);
  }
  job_.motion = &motion_;
}

// B. What the correction changes is the time to come: the publisher evaluates with it, and so does the next frame's A.
void Mapper::settle_phases(const FrameRecord& frame) noexcept {
  const bool breath_known = frame.respiration.known;
  bool breath_told = false;  // or contradicted, which a displacement does not take back
  job_.shared_pose = nullptr;
  if (settings_.phase_from_image || breath_known) {
    const ImagePhases seen = image_phase_.observe(groups_, frame, model_, settings_.estimator);
    job_.shared_pose = image_phase_.shared_pose();
    if (settings_.phase_from_image) settle_cardiac_phase(seen.cardiac);
    if (breath_known && seen.respiratory.outcome == ImagePhaseOutcome::kObserved) {
      const ObservedPhase& breath = seen.respiratory.observed;
      respiration_.add_phase(breath.time, breath.phase_rad, breath.deviation_rad);
      breath_told = true;
    } else if (breath_known && seen.respiratory.outcome == ImagePhaseOutcome::kContradicts) {
      respiration_.add_contradiction(frame.stamp.capture);
      breath_told = true;
    }
  }
  // Where breathing is only watched for: a phase that is off displaces the surface too.
  const bool watched = frame.index % kDisplacementInterval == 0 && frame.phase.state == PhaseState::kLocked;
  const bool asked = settings_.respiration.enabled ? !breath_told : watched;
  if (asked && image_phase_.displacement(groups_, frame, model_, settings_.estimator, displacement_mm_)) {
    displacement_seen_ = true;
    displacement_time_ = frame.stamp.capture;
    respiration_.add_displacement(frame.stamp.capture, displacement_mm_, frame.phase.phase_rad);
  }
  publish_respiration();
}

void Mapper::settle_cardiac_phase(const ImagePhaseAnswer& seen) noexcept {
  switch (seen.outcome) {
    case ImagePhaseOutcome::kObserved:
      cycle_.add(seen.observed);
      r_peaks_.add(seen.observed);
      law_.add(seen.observed);
      counters_.phases_from_image.add();
      break;
    case ImagePhaseOutcome::kTentative:
      law_.add(seen.observed);
      break;
    case ImagePhaseOutcome::kContradicts:
      cycle_.add_contradiction();
      break;
    case ImagePhaseOutcome::kCanNotTell:
      break;
  }
  publish_correction();
}

void Mapper::publish_correction() noexcept {
  CycleCorrection correction = cycle_.correction();
  if (settings_.law_from_image) correction.law = law_.belief();
  phase_cells_.publisher_correction.write(correction);
  phase_cells_.status_correction.write(correction);
}

void Mapper::learn() noexcept {
  const RealtimeScope realtime;
  const Instant capture = job_.frame->stamp.capture;
  // The next frame is expected one period after this one, and needs the budget before its release.
  const Duration period = std::max(capture - last_capture_, Duration(0));
  job_.learn_until = capture + std::min(period, settings_.latency) + settings_.latency - settings_.budget;
  last_capture_ = capture;
  learn_started_ = MonotonicClock::now();
  learning_ = true;
  team_.start(&run_stage<&Mapper::learn_shard>, this);
  if (job_.frame->index % kSearchInterval == 0) respiration_.search(capture);
  if (settings_.lockstep) {
    team_.join();
    starter_.wait_until_done();
  }
}

void Mapper::forget() noexcept {
  const RealtimeScope realtime;
  finish_learning();
  for (FeatureGroup& group : groups_) {
    for (std::size_t lane = 0; lane < group.slots().size(); ++lane) {
      FeatureSlot& slot = group.slots()[lane];
      if (slot.state == SlotState::kStarting) {
        slot.forgotten = true;
      } else if (slot.state != SlotState::kEmpty) {
        slot.state = SlotState::kEmpty;
        bank_.clear(group.feature(lane));
      }
    }
  }
  respiration_ = RespiratoryTracker(settings_.respiration);
  displacement_seen_ = false;
  breath_begun_ = false;
  breath_corrected_ = false;
  breath_state_ = RespirationState::kOff;
  cycle_ = CyclePosterior(settings_.image_alone);
  r_peaks_.forget();
  law_ = LawChoice();
  law_trials_.clear();
  finder_.discard_round();
  publish_nothing();
  counters_.maps_forgotten.add();
}

void Mapper::recall(const MapMemory& memory, Instant now) {
  respiration_.recall(memory.respiration, now);
  breath_begun_ = respiration_.locks() > 0;
  breath_corrected_ = breath_begun_;
  if (settings_.law_from_image) law_.recall(memory.law);
  const double since_s = std::max(0.0, to_seconds(now - memory.last_capture));
  const std::uint32_t left_out = kIdsLeftOut + static_cast<std::uint32_t>(kIdsLeftOutPerSecond * since_s);
  std::size_t index = 0;
  for (const FeatureMemory& feature : memory.features) {
    if (index >= slots_.size()) break;
    if (feature.estimate.x.size() != bank_.layout().state_size()) continue;
    FeatureSlot& slot = slots_[index];
    slot.state = SlotState::kMapped;
    slot.id = feature.id;
    slot.first_observed = feature.first_observed;
    slot.first_observed_px = feature.first_observed_px;
    slot.last_observed = feature.last_observed;
    slot.last_learnt = feature.last_observed;
    slot.patch = feature.patch;
    slot.patch_state = feature.patch_state;
    slot.carried_px = feature.patch_state.px;
    // So long before the first frame that the map alone tells where to look; the difference of the counts is what
    // matters, and wraps.
    slot.last_found_frame = std::uint64_t{0} - (kCarriedMissesAllowed + 1);
    slot.updates = feature.updates;
    slot.converged = feature.converged;
    slot.recalled_converged = feature.converged;
    slot.largest_deviation_mm = feature.largest_deviation_mm;
    bank_.set(static_cast<int>(index), feature.estimate);
    // Taken before breathing was found, and not again since.
    if (breath_begun_ && !feature.breathing) groups_[index / kLanes].begin_breath(index % kLanes, respiration_.wave());
    next_id_ = std::max(next_id_, feature.id + left_out);
    ++index;
  }
  for (ShardCells& cells : cells_) {
    const auto worker = static_cast<std::size_t>(&cells - cells_.data());
    for (TripleBuffer<ShardSnapshot>* cell : {&cells.publisher, &cells.model}) {
      ShardSnapshot& snapshot = cell->back();
      snapshot.any = true;
      snapshot.recalled = true;
      snapshot.capture = memory.last_capture;
      snapshot.instants.fill(Instant{});
      snapshot.features.clear();
      for (auto g = worker; g < groups_.size(); g += tallies_.size()) {
        for (std::size_t lane = 0; lane < groups_[g].slots().size(); ++lane) {
          if (groups_[g].slots()[lane].state != SlotState::kMapped) continue;
          FeatureSnapshot& feature = snapshot.features.emplace_back();
          describe(groups_[g].slots()[lane], memory.last_capture, feature);
          bank_.get(groups_[g].feature(lane), feature.x);
        }
      }
      cell->publish();
    }
  }
  publish_correction();
  publish_respiration();
}

// Before the workers learn from the frame, while they are at rest.
void Mapper::fill_feed() noexcept {
  MapFeed::Batch* batch = feed_.back();
  if (batch == nullptr) return;
  batch->maps_forgotten = counters_.maps_forgotten.get();
  batch->respiration = respiration_.memory();
  batch->law = law_.memory();
  for (MapFeed::Entry& entry : batch->entries) {
    entry.slot = next_fed_slot_;
    next_fed_slot_ = (next_fed_slot_ + 1) % slots_.size();
    const FeatureSlot& slot = slots_[entry.slot];
    entry.mapped = slot.state == SlotState::kMapped && slot.health.state() != HealthState::kInconsistent;
    if (!entry.mapped) continue;
    FeatureMemory& feature = entry.feature;
    feature.id = slot.id;
    feature.first_observed = slot.first_observed;
    feature.first_observed_px = slot.first_observed_px;
    feature.last_observed = slot.last_observed;
    feature.patch = slot.patch;
    feature.patch_state = slot.patch_state;
    feature.updates = slot.updates;
    feature.converged = slot.converged;
    feature.largest_deviation_mm = slot.largest_deviation_mm;
    bank_.get(static_cast<int>(entry.slot), feature.estimate);
    if (slot.slow_error != nullptr) feature.estimate.P += slot.slow_error->covariance();
    feature.breathing = breath_begun_;
  }
  feed_.hand_over();
}

// The workers are at rest and see by their next start what the mapper writes in their place.
void Mapper::publish_nothing() noexcept {
  for (ShardCells& cells : cells_) {
    for (TripleBuffer<ShardSnapshot>* cell : {&cells.publisher, &cells.model}) {
      ShardSnapshot& snapshot = cell->back();
      snapshot.any = false;
      snapshot.features.clear();
      cell->publish();
    }
  }
  publish_correction();
  publish_respiration();
}

void Mapper::finish_learning() noexcept {
  team_.join();
  bool put_off = false;
  Instant ended = learn_started_;
  for (WorkerTally& tally : tallies_) {
    counters_.features_lost_unseen.add(tally.lost_unseen);
    counters_.features_lost_refused.add(tally.lost_refused);
    counters_.features_lost_unstarted.add(tally.lost_unstarted);
    for (std::size_t i = 0; i < kBatchStatuses; ++i) counters_.starts_failed[i].add(tally.starts_failed[i]);
    counters_.features_started_anew.add(tally.started_anew);
    counters_.adoptions_late.add(tally.adoptions_late);
    put_off = put_off || tally.put_off;
    ended = std::max(ended, tally.ended);
    tally = WorkerTally{};
  }
  if (put_off) counters_.learning_put_off.add();
  if (std::exchange(learning_, false)) shed_load(put_off);
  if (ended > learn_started_) {
    counters_.learn.add(ended - learn_started_);
    counters_.frame_compute.add(computed_before_learning_ + (ended - learn_started_));
  }
  const Instant seen = job_.frame != nullptr ? job_.frame->stamp.capture : Instant{};
  std::uint64_t starting = 0;
  std::uint64_t converging = 0;
  std::uint64_t converged = 0;
  std::uint64_t inconsistent = 0;
  for (const FeatureSlot& slot : slots_) {
    if (slot.state == SlotState::kStarting) ++starting;
    if (slot.state != SlotState::kMapped) continue;
    if (slot.health.state() == HealthState::kInconsistent) {
      ++inconsistent;
    } else if (is_called_converged(slot, seen)) {
      ++converged;
    } else {
      ++converging;
    }
  }
  const StartProgress progress = start_progress(slots_, settings_.estimator.start_observations);
  counters_.features_tracked.set(progress.features);
  counters_.start_matches_most.set(progress.most_matches);
  counters_.start_matches_mean.set(progress.mean_matches);
  counters_.features_starting.set(starting);
  counters_.features_converging.set(converging);
  counters_.features_converged.set(converged);
  counters_.features_inconsistent.set(inconsistent);
}

// By the time that the last frame took. What a machine takes differs from run to run, so never in lockstep.
void Mapper::shed_load(bool put_off) noexcept {
  if (!settings_.shedding || settings_.lockstep) return;
  if (shedding_decision_.add({computed_before_learning_, put_off}, shedding_.followed())) counters_.times_shed.add();
  shedding_.note(job_.frame->index, job_.frame->measurable);
  counters_.features_shed.set(shedding_.apply(shedding_decision_.limit()));
}

// Features are predicted, and searched for: the scouts first where there are any.
void Mapper::predict_shard(int worker) noexcept {
  const RealtimeScope realtime;
  for (auto g = static_cast<std::size_t>(worker); g < groups_.size(); g += tallies_.size()) {
    groups_[g].sweep(job_);
    find_in(groups_[g], job_.scouting);
  }
}

void Mapper::find_shard(int worker) noexcept {
  const RealtimeScope realtime;
  for (auto g = static_cast<std::size_t>(worker); g < groups_.size(); g += tallies_.size()) find_in(groups_[g], false);
}

void Mapper::find_in(FeatureGroup& group, bool scouts) noexcept {
  for (std::size_t lane = 0; lane < group.slots().size(); ++lane) {
    FeatureSlot& slot = group.slots()[lane];
    if (slot.is_scout == scouts) predict_and_find(slot, group.prediction(lane), job_, model_, settings_);
  }
}

void Mapper::plan_evaluation(const FrameRecord& frame, const CardiacClock& clock) noexcept {
  const bool on_clock = settings_.clock_period > Duration(0);
  job_.evaluated.begin = settings_.frame_stream ? 0 : kReleasesCovered;
  job_.evaluated.end = on_clock ? kCovariances : kReleasesCovered;
  job_.instants.fill(Instant{});
  if (settings_.frame_stream) plan_releases(frame);
  if (on_clock) plan_instants(frame);
  for (std::size_t i = job_.evaluated.begin; i < job_.evaluated.end; ++i) {
    const Instant valid = job_.instants[i];
    job_.evaluated.b[i] =
        basis_at(settings_.estimator.layout, clock.at(valid).phase_rad, respiration_.clock().at(valid));
  }
}

// From frame to frame, as the last two were.
Duration Mapper::period_before(const FrameRecord& frame) const noexcept {
  const FrameRecord* before = history_->find(frame.index - std::min<std::uint64_t>(frame.index, 1));
  const Duration since = frame.stamp.capture - before->stamp.capture;
  return since > Duration(0) ? std::min(since, kLongestCoveredPeriod) : kLongestCoveredPeriod;
}

// The releases that come while this frame's snapshot is the newest. Where L is some periods they are of frames before
// it, where L is less than one also of frames to come, which are expected a period apart. Told by the stamps alone, as
// below.
void Mapper::plan_releases(const FrameRecord& frame) noexcept {
  const Instant known = std::max(frame.stamp.arrival, last_pose_arrival_);
  std::uint64_t oldest = frame.index;
  while (oldest > 0) {
    const FrameRecord* before = history_->find(oldest - 1);
    if (before == nullptr || before->stamp.capture + settings_.latency < known) break;
    --oldest;
  }
  const Duration period = period_before(frame);
  // So many frames from one to the next that they reach over a period and some time for what comes unevenly.
  constexpr auto kSteps = static_cast<Duration::rep>(kReleasesCovered - 1);
  const auto stride =
      static_cast<std::uint64_t>((period + kReleasesBeyond + kSteps * period - Duration(1)) / (kSteps * period));
  for (std::size_t i = 0; i < kReleasesCovered; ++i) {
    const std::uint64_t index = oldest + i * stride;
    const FrameRecord* record = history_->find(std::min(index, frame.index));
    const auto to_come = static_cast<Duration::rep>(index - record->index);
    job_.instants[i] = record->stamp.capture + to_come * period + settings_.latency + settings_.lead;
  }
  job_.cameras.fill(FrameCamera{});
  const std::uint64_t first = oldest - std::min<std::uint64_t>(oldest, kCamerasBefore);
  for (std::size_t i = 0; i < kCamerasKept && first + i <= frame.index; ++i) {
    const FrameRecord* record = history_->find(first + i);
    if (record == nullptr) continue;
    job_.cameras[i] = {record->stamp.sequence, {record->pose.valid(), record->pose.X_WC}};
  }
}

// From when this frame can be mapped until the next one should have been: a frame later, and some time for what comes
// unevenly. Told by the stamps alone, so that a replay has the same instants every time.
void Mapper::plan_instants(const FrameRecord& frame) noexcept {
  const Instant begin = std::max(frame.stamp.arrival, last_pose_arrival_) + settings_.lead;
  const Duration step = (period_before(frame) + kCoveredBeyond) / static_cast<int>(kInstantsCovered - 1);
  for (std::size_t i = 0; i < kInstantsCovered; ++i) {
    job_.instants[kReleasesCovered + i] = begin + static_cast<int>(i) * step;
  }
}

void Mapper::evaluate_shard(int worker) noexcept {
  const RealtimeScope realtime;
  ShardCells& cells = cells_[static_cast<std::size_t>(worker)];
  for (TripleBuffer<ShardSnapshot>* cell : {&cells.publisher, &cells.model}) {
    ShardSnapshot& snapshot = cell->back();
    snapshot.any = true;
    snapshot.recalled = false;
    snapshot.frame_sequence = job_.frame->stamp.sequence;
    snapshot.capture = job_.frame->stamp.capture;
    snapshot.instants = job_.instants;
    snapshot.cameras = job_.cameras;
    snapshot.camera = {job_.frame->pose.valid(), job_.frame->pose.X_WC};
    snapshot.pose_missing = !job_.frame->pose.valid();
    snapshot.features.clear();
  }
  for (auto g = static_cast<std::size_t>(worker); g < groups_.size(); g += tallies_.size()) {
    groups_[g].evaluate(job_, cells.publisher.back(), cells.model.back());
  }
  cells.publisher.publish();
  cells.model.publish();
}

void Mapper::follow_shard(int worker) noexcept {
  const RealtimeScope realtime;
  for (auto g = static_cast<std::size_t>(worker); g < groups_.size(); g += tallies_.size()) {
    FeatureGroup& group = groups_[g];
    for (std::size_t lane = 0; lane < group.slots().size(); ++lane) {
      settle_match(group.slots()[lane], group.prediction(lane), job_, model_, settings_);
    }
  }
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

void Mapper::adopt_found_features(std::uint64_t frame_index) noexcept {
  auto slot = slots_.begin();
  int room = shedding_decision_.limit() - shedding_.in_sight();
  for (const FoundFeature& found : finder_.adopt(frame_index)) {
    slot = std::find_if(slot, slots_.end(), [](const FeatureSlot& s) { return s.state == SlotState::kEmpty; });
    if (slot == slots_.end() || room-- <= 0) return;
    slot->state = SlotState::kTracked;
    slot->id = next_id_++;
    slot->first_observed = found.first_observed;
    slot->first_observed_px = found.first_observed_px;
    slot->patch = found.patch;
    slot->patch_state = found.patch_state;
    slot->carried_px = found.patch_state.px;
    slot->looks = found.looks;
    slot->velocity_px = found.velocity_px;
    slot->last_found_frame = frame_index - 1;
    slot->stale_matches = 0;
    slot->refused_in_a_row = 0;
    slot->held.clear();
    slot->failed_starts = 0;
    slot->converged = false;
    slot->shed = false;
    slot->in_view = true;
  }
}

void Mapper::offer_to_finder(const FrameRecord& frame, const GreyImage& image, const ColourImage& colour) noexcept {
  occupied_.clear();
  int free = 0;
  for (const FeatureSlot& slot : slots_) {
    if (slot.state == SlotState::kEmpty) ++free;
    // Where it is predicted too: what hides a feature is no place for a new one.
    if (slot.state != SlotState::kEmpty && slot.match.state != MatchState::kInvalidInput) {
      occupied_.push_back(slot.match.px);
    }
  }
  // Where there is no time for those that can be seen, no more are looked for.
  free = std::min(free, shedding_decision_.limit() - shedding_.in_sight());
  finder_.offer(frame.index, frame.stamp, image, colour, occupied_, free);
}

}  // namespace perimap

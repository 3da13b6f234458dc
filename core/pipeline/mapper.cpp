#include "core/pipeline/mapper.hpp"

#include <algorithm>

#include "core/pipeline/map_census.hpp"
#include "core/pipeline/start_progress.hpp"
#include "core/realtime/realtime_scope.hpp"

namespace perimap {
namespace {

// For a counter.
std::uint64_t micrometres(double mm) noexcept { return static_cast<std::uint64_t>(1000.0 * mm); }

}  // namespace

Mapper::Mapper(const PipelineSettings& settings, std::span<FeatureSlot> slots, WorkerTeam& team,
               const Housekeeping& housekeeping, const MapperOutputs& outputs)
    : settings_(settings),
      slots_(slots),
      team_(team),
      starter_(housekeeping.starter),
      watcher_(housekeeping.watcher),
      counters_(outputs.counters),
      trust_(settings.pose, housekeeping.scope, outputs.counters, settings.pictures_may_loop),
      phases_(settings_, outputs.phase_cells, outputs.counters),
      organ_(settings_),
      patches_(slots),
      history_(std::make_unique<FrameHistory>(settings.estimator.layout)),
      bank_({.layout = settings.estimator.layout, .features = static_cast<int>(slots.size())},
            settings.estimator.precision),
      stages_(settings_, slots, bank_, outputs.cells, job_, team, housekeeping.starter, outputs.trace),
      motion_(slots.size()),
      intake_(slots, housekeeping.finder),
      keeping_(slots, bank_, stages_.groups()),
      surface_(slots, bank_, housekeeping.surface_maker, settings.adoption_delay, outputs.counters),
      stopwatch_(outputs.counters, !settings.lockstep, outputs.trace != nullptr ? &outputs.trace->mapper : nullptr),
      shedding_decision_(static_cast<int>(slots.size()), settings.budget),
      shedding_(slots) {
  job_.history = history_.get();
  job_.tracker = &tracker_;
  job_.view_tracker = &view_tracker_;
  counters_.start_matches_needed.set(static_cast<std::uint64_t>(settings.estimator.start_observations));
}

void Mapper::add_pose(const TrackerSample& sample) noexcept {
  const RealtimeScope realtime;
  trust_.add(sample);
}

void Mapper::add_tool_pose(const ToolPose& pose) noexcept {
  const RealtimeScope realtime;
  switch (pose.role) {
    case ToolRole::kSecondSensor:
      trust_.add_second(pose.sample);
      break;
    case ToolRole::kPatient:
      organ_.add_tool(pose.sample);
      break;
  }
}

void Mapper::process(const FrameStamp& stamp, const GreyImage& image, const GreyImage& before,
                     const ColourImage& colour, const CardiacClock& ecg) noexcept {
  const RealtimeScope realtime;
  finish_learning();
  stopwatch_.begin(stamp.sequence);
  follow_organ();
  const FrameRecord& frame = begin_frame(stamp, image, before, ecg);
  // A
  find_features(frame);
  stopwatch_.found();
  // B
  job_.shared_pose = phases_.settle(stages_.groups(), frame);
  stopwatch_.settled();
  // C
  stages_.evaluate();
  stopwatch_.evaluated(frame.stamp.capture);
  hand_on(frame, image, colour);
  // D
  begin_learning(frame);
}

// The phases and the pose at its capture, and what the workers need of them.
const FrameRecord& Mapper::begin_frame(const FrameStamp& stamp, const GreyImage& image, const GreyImage& before,
                                       const CardiacClock& ecg) noexcept {
  take_starts();
  tell_earlier_frames(phases_.begin_frame(ecg, stamp, *history_));
  FrameRecord& frame = history_->append(stamp);
  set_pose(frame, image, before);
  watcher_.adopt(frame);
  phases_.tell(frame, *history_);
  job_.image = image;
  job_.before = before;
  job_.frame = &frame;
  job_.doubts = trust_.doubts();
  watcher_.tell(job_.doubts, settings_.estimator.converged_deviation_mm);
  job_.doubts.displaced = organ_.displaced();
  job_.doubts.cause = organ_.cause();
  job_.doubts.settling = organ_.settling();
  job_.doubts.unproven = organ_.unproven();
  job_.starts_fail_alike = starts_fail_alike(slots_);
  job_.surface_there = surface_.there();
  job_.law = phases_.heart().clock().law_belief();
  job_.about_capture = bases_about(settings_.estimator.layout, frame.phase, frame.respiration);
  plan_evaluation(frame);
  return frame;
}

// Before this frame's adoptions. In lockstep all starts are ready at their frames.
void Mapper::take_starts() noexcept {
  for (FeatureSlot& slot : slots_) {
    BatchStartExchange& start = slot.start;
    const bool awaited = slot.state == SlotState::kStarting && !start.due && history_->count() >= start.adopt_at_frame;
    // Acquire: pairs with housekeeping's release store, so that the whole outcome is visible.
    if (!awaited || !start.ready.load(std::memory_order_acquire)) continue;
    start.due = true;
    if (start.trial && !slot.forgotten) phases_.add(*start.trial);
  }
}

// By what is known now; and what is learnt from them, and was.
void Mapper::tell_earlier_frames(const PatientPhases::Change& change) noexcept {
  const auto& [heart, breath] = change;
  const CardiacClock& by_ecg = phases_.heart().by_ecg();
  const RespiratoryClock& breath_clock = phases_.breathing().clock();
  const std::span<FeatureGroup> groups = stages_.groups();
  if (heart.another_law || breath.lost_before || breath.map_changes()) surface_.begin_again();
  if (heart.another_law) {
    for (FeatureGroup& group : groups) group.doubt();
  }
  if (heart.other_laws) {
    history_->retell_phases(by_ecg);
    watcher_.retell_phases(by_ecg);
  }
  if (breath.told_anew) {
    history_->retell_respiration(breath_clock);
    watcher_.retell_respiration(breath_clock);
  }
  for (FeatureGroup& group : groups) {
    if (breath.lost_before) group.doubt();
    if (breath.begun) group.begin_breath(phases_.breathing().wave(), breath.begun_again);
    if (breath.learnt_again) group.learn_again();
  }
  if (heart.beat) history_->refresh_phases(phases_.heart().completed(), breath_clock);
}

void Mapper::set_pose(FrameRecord& frame, const GreyImage& image, const GreyImage& before) noexcept {
  const PoseTrust::Told told = trust_.begin_frame(frame, *history_, image, before);
  if (told.mistaken_since) {
    history_->disown_poses(*told.mistaken_since);
    watcher_.disown_poses(*told.mistaken_since);
  }
  FrameHistory::set_pose(frame, organ_.pose_by_map(told.pose));
  frame.search_deviation_mm = organ_.search_deviation_mm();
}

void Mapper::plan_evaluation(const FrameRecord& frame) noexcept {
  const Instant known = std::max(frame.stamp.arrival, trust_.last_arrival());
  job_.plan = perimap::plan_evaluation(*history_, frame, known, settings_);
  for (std::size_t i = job_.plan.begin; i < job_.plan.end; ++i) {
    const Instant valid = job_.plan.instants[i];
    job_.evaluated_b[i] = basis_at(settings_.estimator.layout, phases_.heart().clock().at(valid).phase_rad,
                                   phases_.breathing().clock().at(valid));
  }
}

void Mapper::find_features(const FrameRecord& frame) noexcept {
  intake_.adopt(frame.index, room());
  job_.templates = intake_.templates();
  job_.shift = {};
  job_.scouting = choose_scouts(slots_, frame.index);
  stages_.predict_and_find();
  if (!job_.scouting) return;
  job_.shift = shift_of_scouts(slots_);
  stages_.find_others();
}

// What the release need not wait for: the rest of the search, and what housekeeping and whoever keeps the map get of
// the frame.
void Mapper::hand_on(const FrameRecord& frame, const GreyImage& image, const ColourImage& colour) noexcept {
  settle_matches(frame);
  stopwatch_.matches_settled();
  watcher_.keep(*history_, slots_, bank_);
  intake_.offer(frame, image, colour, room());
  trust_.offer(frame, image);
  keeping_.fill_feed({phases_.breathing(), phases_.heart(), watcher_.belief()}, counters_.maps_ended());
  surface_.on_frame(frame, phases_.heart().clock().law().law, job_.doubts);
  counters_.frames.add();
  if (!frame.pose.valid()) counters_.frames_without_pose.add();
  if (frame.pose.valid() && !frame.measurable) counters_.frames_without_phase.add();
  watch_organ(frame);
  patches_.watch(frame, *history_);
}

// Nothing is learnt, from the time on at which the organ may have begun to move: what the map has is to be kept.
void Mapper::watch_organ(const FrameRecord& frame) noexcept {
  organ_.watch(phases_.image(), stages_.groups(), frame);
  tell_displacement();
  if (!organ_.displaced_since()) return;
  const std::uint64_t from_index = history_->first_since(*organ_.displaced_since());
  history_->disown_poses(from_index);
  watcher_.disown_poses(from_index);
}

void Mapper::tell_displacement() noexcept {
  if (organ_.displaced() && counters_.displaced.get() == 0) counters_.times_displaced.add();
  counters_.displaced.set(organ_.displaced() ? 1 : 0);
  counters_.displaced_cause.set(static_cast<std::uint64_t>(organ_.cause()));
  counters_.displaced_um.set(micrometres(organ_.size_mm()));
}

void Mapper::settle_matches(const FrameRecord& frame) noexcept {
  // Where the features that are believed so far were in the frame before, and are now.
  motion_.clear();
  for (const FeatureSlot& slot : slots_) {
    const bool in_both = slot.match.state == MatchState::kFound && slot.last_found_frame + 1 == frame.index;
    if (slot.state != SlotState::kEmpty && in_both) motion_.add(slot.patch_state.px, slot.match.px);
  }
  job_.motion = &motion_;
  stages_.settle_matches();
}

void Mapper::begin_learning(const FrameRecord& frame) noexcept {
  // The next frame is expected one period after this one, and needs the budget before its release.
  const Instant capture = frame.stamp.capture;
  const FrameRecord* before = frame.index > 0 ? history_->find(frame.index - 1) : nullptr;
  const Duration period =
      before != nullptr ? std::max(capture - before->stamp.capture, Duration(0)) : settings_.latency;
  job_.learn_until = capture + std::min(period, settings_.latency) + settings_.latency - settings_.budget;
  stopwatch_.learning_begun();
  stages_.begin_learning();
}

void Mapper::beside_learning() noexcept {
  const RealtimeScope realtime;
  phases_.search_breath(*job_.frame);
  if (settings_.lockstep) {
    team_.join();
    starter_.wait_until_done();
  }
}

void Mapper::finish_learning() noexcept {
  const LearningTally tally = stages_.join();
  counters_.features_lost_unseen.add(tally.lost_unseen);
  counters_.features_lost_refused.add(tally.lost_refused);
  counters_.features_lost_unstarted.add(tally.lost_unstarted);
  for (std::size_t i = 0; i < kBatchStatuses; ++i) counters_.starts_failed[i].add(tally.starts_failed[i]);
  counters_.features_started_anew.add(tally.started_anew);
  surface_.count_starts(tally.begun_on_surface, tally.off_surface);
  counters_.adoptions_late.add(tally.adoptions_late);
  if (tally.put_off) counters_.learning_put_off.add();
  if (stopwatch_.learnt(tally.ended)) shed_load(tally.put_off);
  const Instant seen = job_.frame != nullptr ? job_.frame->stamp.capture : Instant{};
  count_states(slots_, seen, job_.doubts, settings_.estimator.start_observations, counters_);
  organ_.note_converged(counters_.features_converged.get() > 0);
}

// By the time that the last frame took. What a machine takes differs from run to run, so never in lockstep.
void Mapper::shed_load(bool put_off) noexcept {
  if (!settings_.shedding || settings_.lockstep) return;
  const FrameRate rate = job_.frame->rate;
  if (shedding_decision_.add({stopwatch_.computed(), put_off, rate}, shedding_.followed())) {
    counters_.times_shed.add();
  }
  shedding_.note(job_.frame->index, job_.frame->measurable, rate);
  counters_.features_shed.set(shedding_.apply(shedding_decision_.limit()));
}

// So many more features may be followed: where there is no time for those that can be seen, no more are looked for.
int Mapper::room() const noexcept { return shedding_decision_.limit() - shedding_.in_sight(); }

void Mapper::forget() noexcept {
  const RealtimeScope realtime;
  finish_learning();
  phases_.forget();
  keeping_.forget();
  surface_.forget();
  intake_.discard_round();
  watcher_.begin_window_anew();
  organ_.forget();
  patches_.forget();
  tell_displacement();
  stages_.hand_over_nothing();
  phases_.publish();
  counters_.maps_forgotten.add();
}

bool Mapper::move_map() noexcept {
  const RealtimeScope realtime;
  finish_learning();
  const std::optional<RestingOrgan> organ = organ_.resting();
  if (!organ) {
    counters_.moves_refused.add();
    return false;
  }
  move_map_with(*organ);
  return true;
}

// Its tool has told that it was moved, and it rests.
void Mapper::follow_organ() noexcept {
  if (const std::optional<RestingOrgan> organ = organ_.carried()) move_map_with(*organ);
}

void Mapper::move_map_with(const RestingOrgan& organ) noexcept {
  keeping_.displace(organ.X, organ.deviation_mm);
  // What is held was seen of the organ where it was.
  history_->disown_poses(0);
  surface_.begin_again();
  watcher_.begin_window_anew();
  organ_.begin_anew();
  patches_.forget();
  counters_.moved_um.set(micrometres(organ.size_mm));
  counters_.maps_moved.add();
  tell_displacement();
}

void Mapper::recall(const MapMemory& memory, Instant now) {
  phases_.recall(memory, now);
  watcher_.recall(memory.setup);
  const std::uint32_t largest_id = keeping_.recall(memory.features, phases_.breathing());
  if (largest_id > 0) intake_.go_on_from(largest_id, now - memory.last_capture);
  FrameDoubts doubts;
  watcher_.tell(doubts, settings_.estimator.converged_deviation_mm);
  stages_.hand_over_recalled(memory.last_capture, doubts);
  phases_.publish();
}

}  // namespace perimap

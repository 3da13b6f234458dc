#include "core/pipeline/mapper.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "core/pipeline/map_census.hpp"
#include "core/pipeline/start_progress.hpp"
#include "core/realtime/realtime_scope.hpp"

namespace perimap {
namespace {

HeartPhaseSettings heart_settings(const PipelineSettings& settings) noexcept {
  return {settings.law_from_image, settings.image_alone};
}

// Bit for bit: a sensor has noise, so what it gives twice is old.
bool same_pose(const Pose& a, const Pose& b) noexcept { return a.t == b.t && a.R == b.R; }
// But where it shows nothing at all: a lens that is covered is black, and all its noise is cut off.
bool same_picture(const GreyImage& a, const GreyImage& b) noexcept {
  if (a.data == nullptr || b.data == nullptr || a.width != b.width || a.height != b.height) return false;
  bool plain = true;
  for (int y = 0; y < a.height; ++y) {
    if (std::memcmp(a.row(y), b.row(y), static_cast<std::size_t>(a.width)) != 0) return false;
    const auto differs = [first = *a.row(0)](std::uint8_t pixel) { return pixel != first; };
    plain = plain && std::none_of(a.row(y), a.row(y) + a.width, differs);
  }
  return !plain;
}

}  // namespace

Mapper::Mapper(const PipelineSettings& settings, std::span<FeatureSlot> slots, std::span<ShardCells> cells,
               WorkerTeam& team, FeatureFinder& finder, BatchStarter& starter, SetupWatcher& watcher,
               SurfaceMaker& surface_maker, ScopeWatch* scope, PhaseCells& phase_cells, PipelineCounters& counters)
    : settings_(settings),
      model_{settings.camera},
      slots_(slots),
      team_(team),
      starter_(starter),
      watcher_(watcher),
      scope_(scope),
      phase_cells_(phase_cells),
      counters_(counters),
      poses_(settings.pose),
      heart_(heart_settings(settings)),
      breathing_(settings.respiration),
      history_(std::make_unique<FrameHistory>(settings.estimator.layout)),
      bank_({.layout = settings.estimator.layout, .features = static_cast<int>(slots.size())},
            settings.estimator.precision),
      stages_(settings_, slots, bank_, cells, job_, team, starter),
      motion_(slots.size()),
      intake_(slots, finder),
      keeping_(slots, bank_, stages_.groups()),
      surface_(slots, bank_, surface_maker, settings.adoption_delay, counters),
      shedding_decision_(static_cast<int>(slots.size()), settings.budget),
      shedding_(slots) {
  job_.history = history_.get();
  job_.tracker = &tracker_;
  job_.view_tracker = &view_tracker_;
  counters_.start_matches_needed.set(static_cast<std::uint64_t>(settings.estimator.start_observations));
}

void Mapper::add_pose(const TrackerSample& sample) noexcept {
  const RealtimeScope realtime;
  const bool valid = sample.state == ToolState::kOk;
  const bool repeated = valid && last_reading_ && same_pose(*last_reading_, sample.X_WS);
  if (repeated) counters_.poses_repeated.add();
  // By arrival: a tracker that has stopped may stamp as if it had not.
  pose_repeats_.add(repeated, sample.arrival);
  last_reading_ = valid ? std::optional(sample.X_WS) : std::nullopt;
  if (!poses_.add(sample)) counters_.poses_refused.add();
  last_pose_arrival_ = std::max(last_pose_arrival_, sample.arrival);
  if (scope_ != nullptr) scope_->add_pose(sample);
}

void Mapper::add_second_pose(const TrackerSample& sample) noexcept {
  const RealtimeScope realtime;
  if (scope_ != nullptr) scope_->add_second_pose(sample);
}

void Mapper::process(const FrameStamp& stamp, const GreyImage& image, const GreyImage& before,
                     const ColourImage& colour, const CardiacClock& ecg) noexcept {
  const RealtimeScope realtime;
  finish_learning();
  const Instant begun = MonotonicClock::now();
  const FrameRecord& frame = begin_frame(stamp, image, before, ecg);
  StageEnds ends;
  // A
  job_.image = image;
  job_.before = before;
  find_features(frame);
  ends.found = MonotonicClock::now();
  // B
  settle_phases(frame);
  ends.settled = MonotonicClock::now();
  // C
  stages_.evaluate();
  ends.evaluated = MonotonicClock::now();
  // What the release need not wait for.
  settle_matches(frame);
  computed_before_learning_ = MonotonicClock::now() - begun;
  watcher_.take(*history_, slots_, bank_);
  intake_.offer(frame, image, colour, room());
  if (scope_ != nullptr) scope_->offer(frame.index, frame.rate, image);
  keeping_.fill_feed(breathing_, heart_, counters_.maps_forgotten.get());
  surface_.on_frame(frame, heart_.clock().law().law, job_.doubts.setup_variance_mm2);
  count(frame, begun, ends);
  // D
  begin_learning(frame);
}

// The phases and the pose at its capture, and what the workers need of them.
const FrameRecord& Mapper::begin_frame(const FrameStamp& stamp, const GreyImage& image, const GreyImage& before,
                                       const CardiacClock& ecg) noexcept {
  take_starts();
  const Breathing::Change breath = breathing_.begin_frame(*history_);
  if (breath.map_changes()) heart_.forget_r_peaks();
  const HeartPhase::Change heart = heart_.begin_frame(ecg, stamp.arrival, stamp.capture);
  tell_earlier_frames(heart, breath);
  FrameRecord& frame = history_->append(stamp);
  frame.repeated = same_picture(image, before);
  heed_repeats(frame);
  set_pose(frame, image);
  parallax_.add(frame.pose, stamp.capture);
  job_.doubts.still = parallax_.none();
  job_.starts_fail_alike = starts_fail_alike(slots_);
  watcher_.adopt(frame);
  job_.doubts.setup_doubted = watcher_.belief().doubted();
  job_.doubts.setup_variance_mm2 = watcher_.belief().variance_mm2();
  history_->set_phase(frame, heart_.clock(), breathing_.clock());
  breathing_.expect_displacement(frame);
  job_.frame = &frame;
  job_.law = heart_.clock().law_belief();
  job_.about_capture = bases_about(settings_.estimator.layout, frame.phase, frame.respiration);
  plan_evaluation(frame);
  return frame;
}

// What is given again and again is old. A tracker that has said one pose all along may be one that keeps still.
void Mapper::heed_repeats(const FrameRecord& frame) noexcept {
  if (frame.repeated) counters_.frames_repeated.add();
  picture_repeats_.add(frame.repeated, frame.stamp.capture);
  job_.doubts.picture_repeated = picture_repeats_.long_enough();
  const bool stuck = pose_repeats_.long_enough() && parallax_.ever();
  if (stuck && !job_.doubts.pose_repeated) disown_poses(history_->first_since(pose_repeats_.since()));
  job_.doubts.pose_repeated = stuck;
}

void Mapper::disown_poses(std::uint64_t since_frame) noexcept {
  history_->disown_poses(since_frame);
  watcher_.disown_poses(since_frame);
}

// By the tracker, and by how the scope is turned: without either there is none.
void Mapper::set_pose(FrameRecord& frame, const GreyImage& image) noexcept {
  bool known = !job_.doubts.pose_repeated;
  double turn_deviation_rad = 0.0;
  if (scope_ != nullptr) {
    const ScopeWatch::Frame scope = scope_->begin_frame(frame.index, frame.stamp.capture, image);
    if (scope.mistaken_since) disown_poses(*scope.mistaken_since);
    if (scope.mistaken_from) disown_poses(history_->first_since(*scope.mistaken_from));
    job_.doubts.scope_unread = scope.unread;
    job_.doubts.scope_changed = scope.changed;
    known = known && !scope.unread && !scope.changed;
    if (scope.state) {
      poses_.set_hand_eye(scope.state->X_SC);
      frame.picture = scope.state->picture;
      turn_deviation_rad = scope.state->rotation_deviation_rad;
    }
  }
  CameraPose pose = known ? poses_.at(frame.stamp.capture) : CameraPose();
  pose.rotation_variance_rad2 += turn_deviation_rad * turn_deviation_rad;
  FrameHistory::set_pose(frame, pose);
}

// Before this frame's adoptions. In lockstep all starts are ready at their frames.
void Mapper::take_starts() noexcept {
  for (FeatureSlot& slot : slots_) {
    BatchStartExchange& start = slot.start;
    const bool awaited = slot.state == SlotState::kStarting && !start.due && history_->count() >= start.adopt_at_frame;
    // Acquire: pairs with housekeeping's release store, so that the whole outcome is visible.
    if (!awaited || !start.ready.load(std::memory_order_acquire)) continue;
    start.due = true;
    if (start.trial && !slot.forgotten) heart_.add(*start.trial);
  }
}

// By what is known now; and what is learnt from them, and was.
void Mapper::tell_earlier_frames(const HeartPhase::Change& heart, const Breathing::Change& breath) noexcept {
  const std::span<FeatureGroup> groups = stages_.groups();
  if (heart.another_law || breath.lost_before || breath.map_changes()) surface_.begin_again();
  if (heart.another_law) {
    for (FeatureGroup& group : groups) group.doubt();
  }
  if (heart.other_laws) {
    history_->retell_phases(heart_.by_ecg());
    watcher_.retell_phases(heart_.by_ecg());
  }
  if (breath.told_anew) {
    history_->retell_respiration(breathing_.clock());
    watcher_.retell_respiration(breathing_.clock());
  }
  for (FeatureGroup& group : groups) {
    if (breath.lost_before) group.doubt();
    if (breath.begun) group.begin_breath(breathing_.wave(), breath.begun_again);
    if (breath.learnt_again) group.learn_again();
  }
  if (heart.beat) history_->refresh_phases(heart_.completed(), breathing_.clock());
}

void Mapper::plan_evaluation(const FrameRecord& frame) noexcept {
  const Instant known = std::max(frame.stamp.arrival, last_pose_arrival_);
  job_.plan = perimap::plan_evaluation(*history_, frame, known, settings_);
  for (std::size_t i = job_.plan.begin; i < job_.plan.end; ++i) {
    const Instant valid = job_.plan.instants[i];
    job_.evaluated_b[i] =
        basis_at(settings_.estimator.layout, heart_.clock().at(valid).phase_rad, breathing_.clock().at(valid));
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

// What is learnt of the phases changes the time to come: the publisher evaluates with it, and so does the next frame's
// A.
void Mapper::settle_phases(const FrameRecord& frame) noexcept {
  const bool breath_known = frame.respiration.known;
  bool breath_told = false;
  job_.shared_pose = nullptr;
  if (settings_.phase_from_image || breath_known) {
    const ImagePhases seen = image_phase_.observe(stages_.groups(), frame, model_, settings_.estimator);
    job_.shared_pose = image_phase_.shared_pose();
    if (settings_.phase_from_image) {
      heart_.observe(seen.cardiac);
      if (seen.cardiac.outcome == ImagePhaseOutcome::kObserved) counters_.phases_from_image.add();
    }
    if (breath_known) breath_told = breathing_.observe(seen.respiratory, frame.stamp.capture);
  }
  Vector3d displacement_mm;
  if (breathing_.asks_for_displacement(frame, breath_told) &&
      image_phase_.displacement(stages_.groups(), frame, model_, settings_.estimator, displacement_mm)) {
    breathing_.add_displacement(frame, displacement_mm);
  }
  publish_phases();
}

void Mapper::publish_phases() noexcept {
  const PhaseBelief heart = heart_.belief();
  phase_cells_.publisher_heart.write(heart);
  phase_cells_.status_heart.write(heart);
  const RespiratoryClock breath = breathing_.published();
  phase_cells_.publisher_breath.write(breath);
  phase_cells_.status_breath.write(breath);
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
  const Instant capture = frame.stamp.capture;
  // The next frame is expected one period after this one, and needs the budget before its release.
  const Duration period = std::max(capture - last_capture_, Duration(0));
  job_.learn_until = capture + std::min(period, settings_.latency) + settings_.latency - settings_.budget;
  last_capture_ = capture;
  learn_started_ = MonotonicClock::now();
  learning_ = true;
  stages_.begin_learning();
}

void Mapper::beside_learning() noexcept {
  const RealtimeScope realtime;
  breathing_.search(*job_.frame);
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
  counters_.adoptions_late.add(tally.adoptions_late);
  if (tally.put_off) counters_.learning_put_off.add();
  if (std::exchange(learning_, false)) shed_load(tally.put_off);
  if (tally.ended > learn_started_) {
    counters_.learn.add(tally.ended - learn_started_);
    counters_.frame_compute.add(computed_before_learning_ + (tally.ended - learn_started_));
  }
  const Instant seen = job_.frame != nullptr ? job_.frame->stamp.capture : Instant{};
  count_states(slots_, seen, settings_.estimator.start_observations, counters_);
}

// By the time that the last frame took. What a machine takes differs from run to run, so never in lockstep.
void Mapper::shed_load(bool put_off) noexcept {
  if (!settings_.shedding || settings_.lockstep) return;
  const FrameRate rate = job_.frame->rate;
  if (shedding_decision_.add({computed_before_learning_, put_off, rate}, shedding_.followed())) {
    counters_.times_shed.add();
  }
  shedding_.note(job_.frame->index, job_.frame->measurable, rate);
  counters_.features_shed.set(shedding_.apply(shedding_decision_.limit()));
}

// So many more features may be followed: where there is no time for those that can be seen, no more are looked for.
int Mapper::room() const noexcept { return shedding_decision_.limit() - shedding_.in_sight(); }

void Mapper::count(const FrameRecord& frame, Instant begun, const StageEnds& ends) noexcept {
  counters_.predict_and_find.add(ends.found - begun);
  counters_.phase_and_pose.add(ends.settled - ends.found);
  counters_.evaluate.add(ends.evaluated - ends.settled);
  // In lockstep the capture lies on the recording's clock, not on this machine's.
  if (!settings_.lockstep) counters_.capture_to_update.add(ends.evaluated - frame.stamp.capture);
  counters_.frames.add();
  if (!frame.pose.valid()) counters_.frames_without_pose.add();
  if (frame.pose.valid() && !frame.measurable) counters_.frames_without_phase.add();
}

void Mapper::forget() noexcept {
  const RealtimeScope realtime;
  finish_learning();
  keeping_.forget();
  surface_.forget();
  intake_.discard_round();
  watcher_.begin_window_anew();
  heart_ = HeartPhase(heart_settings(settings_), heart_.beats());
  breathing_ = Breathing(settings_.respiration);
  stages_.hand_over_nothing();
  publish_phases();
  counters_.maps_forgotten.add();
}

void Mapper::recall(const MapMemory& memory, Instant now) {
  breathing_.recall(memory.respiration, now);
  heart_.recall(memory.law);
  const std::uint32_t largest_id = keeping_.recall(memory.features, breathing_);
  if (largest_id > 0) intake_.go_on_from(largest_id, now - memory.last_capture);
  stages_.hand_over_recalled(memory.last_capture);
  publish_phases();
}

}  // namespace perimap

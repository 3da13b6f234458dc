#include "core/pipeline/breathing.hpp"

#include <chrono>

#include "core/pipeline/feature_group.hpp"

namespace perimap {
namespace {

// From one search for breathing to the next, and, where it is not asked for, from one look at the common displacement
// to the next.
constexpr Duration kSearchInterval = std::chrono::milliseconds(1067);
constexpr Duration kDisplacementInterval = std::chrono::milliseconds(100);
// How well a frame tells the common displacement while the map is young, and how fast breathing changes it.
constexpr double kDisplacementDeviation_mm = 1.0;
constexpr double kDisplacementRate_mm_per_s = 15.0;
constexpr double kExactTracker_mm2 = 0.25;

}  // namespace

bool pays_to_learn_again(const FrameHistory& history) noexcept {
  const FrameRecord* newest = history.newest();
  return newest != nullptr && newest->tracker_variance_mm2 <= kExactTracker_mm2;
}

Breathing::Change Breathing::begin_frame(const FrameHistory& history) noexcept {
  Change change;
  if (corrected_) return change;
  const RespiratoryClock& breath = tracker_.clock();
  const bool locked = breath.state == RespirationState::kLocked;
  const bool again = pays_to_learn_again(history);
  if (breath.state != told_) {
    told_ = breath.state;
    change.told_anew = true;
    if (locked) {
      change.begun = true;
      change.begun_again = again;
      change.lost_before = begun_;
      begun_ = true;
      // So many are learnt in a frame, one of which is new.
      if (again) tracker_.map_catches_up_for(history.span() / (kLearnPerFrame - 1));
    }
  }
  if (locked && breath.corrected) {
    corrected_ = true;
    change.told_anew = true;
    change.learnt_again = again;
  }
  return change;
}

void Breathing::expect_displacement(FrameRecord& frame) const noexcept {
  frame.displacement_deviation_mm = frame.respiration.deviation_mm;
  if (frame.respiration.known || !displaced_) return;
  const double age_s = to_seconds(frame.stamp.capture - displacement_time_);
  const double deviation_mm = kDisplacementDeviation_mm + kDisplacementRate_mm_per_s * age_s;
  if (!(deviation_mm < frame.displacement_deviation_mm)) return;
  frame.displacement_mm = displacement_mm_;
  frame.displacement_deviation_mm = deviation_mm;
}

bool Breathing::observe(const ImagePhaseAnswer& seen, Instant capture) noexcept {
  switch (seen.outcome) {
    case ImagePhaseOutcome::kObserved:
      tracker_.add_phase(seen.observed.time, seen.observed.phase_rad, seen.observed.deviation_rad);
      return true;
    case ImagePhaseOutcome::kContradicts:
      tracker_.add_contradiction(capture);
      return true;
    case ImagePhaseOutcome::kTentative:
    case ImagePhaseOutcome::kCanNotTell:
      return false;
  }
  return false;
}

bool Breathing::asks_for_displacement(const FrameRecord& frame, bool phase_told) const noexcept {
  if (settings_.enabled) return !phase_told;
  // Where breathing is only watched for: a phase that is off displaces the surface too.
  return frame.index % frame.rate.frames(kDisplacementInterval) == 0 && frame.phase.state == PhaseState::kLocked;
}

void Breathing::add_displacement(const FrameRecord& frame, const Vector3d& displacement_mm) noexcept {
  displaced_ = true;
  displacement_mm_ = displacement_mm;
  displacement_time_ = frame.stamp.capture;
  tracker_.add_displacement(frame.stamp.capture, displacement_mm, frame.phase.phase_rad);
}

void Breathing::search(const FrameRecord& frame) noexcept {
  if (frame.index % frame.rate.frames(kSearchInterval) == 0) tracker_.search(frame.stamp.capture);
}

RespiratoryClock Breathing::published() const noexcept {
  RespiratoryClock clock = tracker_.clock();
  clock.corrected = clock.corrected && corrected_;
  return clock;
}

void Breathing::recall(const RespirationMemory& memory, Instant now) noexcept {
  tracker_.recall(memory, now);
  begun_ = corrected_ = tracker_.locks() > 0;
}

}  // namespace perimap

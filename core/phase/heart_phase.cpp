#include "core/phase/heart_phase.hpp"

#include <span>

namespace perimap {

void HeartPhase::add(const LawTrial& trial) noexcept {
  if (trial_count_ < kMostTrials) trials_[trial_count_++] = trial;
}

HeartPhase::Change HeartPhase::begin_frame(const CardiacClock& ecg, Instant now, Instant capture) noexcept {
  Change change;
  by_ecg_ = ecg.as_of(now);
  change.beat = by_ecg_.beats() != beats_;
  if (settings_.law_from_image) weigh_laws(capture, change);
  by_ecg_ = PhaseBelief{believed_law(), {}}.under_law(ecg, now);
  // Under laws that are not ruled out the same phases would tell of other R peaks.
  if (change.beat && !by_ecg_.law_belief().laws().undecided()) r_peaks_.on_beat(by_ecg_);
  beats_ = by_ecg_.beats();
  posterior_.follow(by_ecg_, capture);
  clock_ = belief().clock(ecg, now);
  return change;
}

void HeartPhase::weigh_laws(Instant capture, Change& change) noexcept {
  const BelievedLaws before = law_.belief().laws();
  // Not while the images carry the phase on: by the law that it was told by when they began.
  if (trial_count_ >= LawChoice::kFewestTrials && by_ecg_.at(capture).state == PhaseState::kLocked) {
    change.another_law = law_.weigh(std::span(trials_).first(trial_count_));
    trial_count_ = 0;
  }
  if (change.beat) change.another_law = law_.on_beat(by_ecg_) || change.another_law;
  change.other_laws = law_.belief().laws() != before;
  if (change.other_laws) r_peaks_.forget();
}

void HeartPhase::observe(const ImagePhaseAnswer& seen) noexcept {
  switch (seen.outcome) {
    case ImagePhaseOutcome::kObserved:
      posterior_.add(seen.observed);
      r_peaks_.add(seen.observed);
      law_.add(seen.observed);
      break;
    case ImagePhaseOutcome::kTentative:
      law_.add(seen.observed);
      break;
    case ImagePhaseOutcome::kContradicts:
      posterior_.add_contradiction();
      break;
    case ImagePhaseOutcome::kCanNotTell:
      break;
  }
}

std::optional<LawBelief> HeartPhase::believed_law() const noexcept {
  if (!settings_.law_from_image) return std::nullopt;
  return law_.belief();
}

PhaseBelief HeartPhase::belief() const noexcept { return {believed_law(), posterior_.correction()}; }

}  // namespace perimap

#include "core/phase/cardiac_clock.hpp"

#include <algorithm>
#include <cmath>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

constexpr double kOverdueDeviations = 3.0;
// A heart moves 48 mm/s RMS: less is within a millimetre.
constexpr double kLawsDiffer_s = 0.02;

Duration rounded(Seconds s) noexcept { return from_seconds(s.count()); }

// From those of two independent instants.
Duration deviation_of_difference(Duration a, Duration b) noexcept {
  return from_seconds(std::hypot(to_seconds(a), to_seconds(b)));
}

}  // namespace

PhaseEstimate CardiacClock::at(Instant t) const noexcept {
  const Located located = locate(t);
  PhaseEstimate estimate;
  estimate.state = located.state;
  if (located.cycle.length <= Duration::zero()) return estimate;

  const CardiacCycle& cycle = located.cycle;
  const CyclePhase phase = phase_in_cycle(law_.settings, t - cycle.begin, cycle.length, cycle.previous_length);
  estimate.phase_rad = phase.phase_rad < kTwoPi ? phase.phase_rad : 0.0;
  estimate.rate_rad_per_s = phase.rate_rad_per_s;
  estimate.exact = located.exact;
  estimate.contradicted = contradicted_ && !located.exact;
  estimate.teaches = cycle.teaches;
  estimate.ectopic = located.ectopic;

  const double w = phase.length_sensitivity;
  const double begin = to_seconds(cycle.begin_deviation);
  const double length = to_seconds(cycle.length_deviation);
  // The beginning ends the cycle before as well: a measured one shares its own error with that one's length, a
  // predicted one all of that length's. Where the length is not known at all the term is too much, and small.
  const double p = phase.previous_sensitivity;
  const double previous = to_seconds(cycle.previous_length_deviation);
  const double shared = std::min(begin, previous);
  // Where both ends are measured their errors are shared out by how much the phase is bound to each.
  const double bound = located.exact ? 1.0 - w : 1.0;
  const double irregular = located.exact ? w * to_seconds(located.irregularity) : 0.0;
  estimate.deviation_s = std::sqrt(bound * bound * begin * begin + 2.0 * bound * p * shared * shared +
                                   p * p * previous * previous + w * w * length * length + irregular * irregular);
  const double law_rad = law_deviation_rad(law_, phase.phase_rad, t - cycle.begin, cycle.length, cycle.previous_length);
  estimate.deviation_s = std::hypot(estimate.deviation_s, law_rad / phase.rate_rad_per_s);
  estimate.law_undecided =
      !located.exact && law_difference_s(law_, cycle.length, cycle.previous_length) > kLawsDiffer_s;
  return estimate;
}

CardiacClock CardiacClock::with_law(const LawBelief& law) const noexcept {
  CardiacClock clock = *this;
  clock.law_ = law;
  return clock;
}

CardiacClock CardiacClock::as_of(Instant now) const noexcept {
  CardiacClock clock = *this;
  clock.now_ = now;
  if (samples_ && now - heard_until_ > kSilence) clock.interrupted_ = true;
  return clock;
}

CardiacClock CardiacClock::corrected(const CycleCorrection& correction) const noexcept {
  CardiacClock clock = *this;
  if (correction.beats == 0) return clock;
  if (correction.carried) {
    if (at(now_).state == PhaseState::kLocked) return clock;
    clock.carry(correction);
  } else if (correction.beats != beats_) {
    return clock;
  }
  clock.history_[0].time = correction.begin;
  clock.history_[0].deviation = correction.begin_deviation;
  clock.given_way_ = correction.given_way;
  clock.predicted_[0] = Seconds(to_seconds(correction.length));
  clock.running_deviation_ = Seconds(to_seconds(correction.length_deviation));
  clock.contradicted_ = correction.contradicted;
  if (correction.next_length > Duration::zero()) {
    clock.predicted_[1] = Seconds(to_seconds(correction.next_length));
    clock.next_deviation_ = Seconds(to_seconds(correction.next_length_deviation));
  }
  return clock;
}

CardiacClock CardiacClock::with_r_peaks(std::span<const MovedRPeak> moved) const noexcept {
  CardiacClock clock = *this;
  if (carried_) return clock;
  for (const MovedRPeak& peak : moved) {
    if (peak.beat == 0 || peak.beat > beats_ || beats_ - peak.beat >= static_cast<std::uint64_t>(held_)) continue;
    Beat& beat = clock.history_[beats_ - peak.beat];
    beat.time += peak.by;
    beat.deviation = peak.deviation;
  }
  return clock;
}

void CardiacClock::push(const Beat& beat) noexcept {
  std::copy_backward(history_.begin(), history_.end() - 1, history_.end());
  history_[0] = beat;
  held_ = std::min(held_ + 1, static_cast<int>(history_.size()));
}

// Makes room for the beginning of the cycle that the images carry on, and for that of the cycle before, unless these
// are known R peaks. A beat that has come since is no such one: it has not locked the rhythm again.
void CardiacClock::carry(const CycleCorrection& correction) noexcept {
  carried_ = true;
  seen_ = correction.seen;
  const bool follows = correction.beats == beats_;
  if (follows && correction.ahead == 0) return;
  Beat beat;
  beat.unheard = true;
  if (!follows || correction.ahead > 1) {
    // Those before it are not kept: from the last known R peak on there is a gap.
    beat.time = correction.begin - correction.previous_length;
    beat.deviation = correction.begin_deviation;
    push(beat);
  }
  beat.index_in_run = kBeatsToLock;
  push(beat);
}

CardiacClock::Located CardiacClock::locate(Instant t) const noexcept {
  if (held_ == 0 || t < beat(std::min(held_ - 1, kCompletedCycles)).time) return {};
  if (t >= beat(0).time) return locate_predicted(t);
  int newer = 0;
  while (beat(newer + 1).time > t) ++newer;
  return locate_completed(newer);
}

// The cycle that ended with history_[newer]. Its length deviation is that of its end.
CardiacClock::Located CardiacClock::locate_completed(int newer) const noexcept {
  const Beat& end = beat(newer);
  const Beat& begin = beat(newer + 1);
  Located located;
  if (end.index_in_run == 0) {
    located.state = PhaseState::kLost;
    return located;
  }
  // A cycle counts once its run has reached kBeatsToLock, be it by beats that came after.
  std::uint32_t reached = end.index_in_run;
  for (int i = newer - 1; i >= 0 && beat(i).index_in_run > reached; --i) reached = beat(i).index_in_run;
  if (reached + 1 < kBeatsToLock) return located;

  located.exact = !end.unheard;
  located.state = located.exact ? PhaseState::kLocked : carried_state();
  located.irregularity = end.irregularity;
  located.cycle.teaches = end.teaches;
  located.cycle.begin = begin.time;
  located.cycle.begin_deviation = begin.deviation;
  located.cycle.length = end.time - begin.time;
  located.cycle.length_deviation = end.deviation;
  located.cycle.previous_length = located.cycle.length;
  located.cycle.previous_length_deviation = rounded(length_deviation_);
  if (begin.index_in_run > 0 && newer + 2 < held_) {
    const Beat& before = beat(newer + 2);
    located.cycle.previous_length = begin.time - before.time;
    located.cycle.previous_length_deviation = deviation_of_difference(begin.deviation, before.deviation);
  }
  return located;
}

CardiacClock::Located CardiacClock::locate_predicted(Instant t) const noexcept {
  Located located;
  const bool settling = beat(0).index_in_run + 1 < kBeatsToLock;
  if ((settling && !beat(0).resumed) || predicted_length() <= Duration::zero()) return located;

  if (t > lost_from()) {
    located.state = PhaseState::kLost;
    return located;
  }
  const bool overdue = t > expected_until();
  located.state = PhaseState::kLocked;
  if (overdue || interrupted_ || carried_ || settling) located.state = PhaseState::kFreeRunning;
  if (!overdue && carried_) located.state = carried_state();
  located.ectopic = beat(0).beat_class == BeatClass::kPremature;
  const bool nobody_heard = unheard();

  CardiacCycle& cycle = located.cycle;
  cycle.begin = beat(0).time;
  cycle.begin_deviation = beat(0).deviation;
  cycle.previous_length = last_rr();
  cycle.previous_length_deviation = deviation_of_difference(beat(0).deviation, beat(1).deviation);
  if (cycle.previous_length <= Duration::zero()) {
    cycle.previous_length = predicted_length();
    cycle.previous_length_deviation = rounded(length_deviation_);
  }
  double variance_s2 = to_seconds(beat(0).deviation) * to_seconds(beat(0).deviation);
  for (int ahead = 0;; ++ahead) {
    const Seconds told = ahead == 0 ? running_deviation_ : ahead == 1 ? next_deviation_ : length_deviation_;
    const Seconds deviation(nobody_heard ? std::hypot(told.count(), premature_deviation_.count()) : told.count());
    cycle.length = predicted_length(ahead);
    cycle.length_deviation = rounded(deviation);
    if (t < cycle.begin + cycle.length) return located;
    cycle.begin += cycle.length;
    variance_s2 += deviation.count() * deviation.count();
    cycle.begin_deviation = from_seconds(std::sqrt(variance_s2));
    cycle.previous_length = cycle.length;
    cycle.previous_length_deviation = cycle.length_deviation;
  }
}

Instant CardiacClock::expected_until() const noexcept {
  // What the images carry on has been seen; what they have not even begun to show a cycle later has not.
  if (carried_) return predicted_r_peak() + predicted_length();
  const Duration slack = std::min(rounded(kOverdueDeviations * running_deviation_), predicted_length());
  return predicted_r_peak() + slack + detector_delay_;
}

CardiacCycle CardiacClock::cycle_at(Instant t) const noexcept {
  const Located located = locate(t);
  CardiacCycle cycle = located.cycle;
  cycle.completed = located.exact;
  cycle.irregularity = located.irregularity;
  if (cycle.length > Duration::zero()) {
    cycle.systole = rounded(systole_duration(law_.settings, cycle.length, cycle.previous_length));
  }
  return cycle;
}

Instant CardiacClock::anchor() const noexcept { return beat(0).time - given_way_; }
Duration CardiacClock::anchor_deviation() const noexcept { return beat(0).deviation; }
Duration CardiacClock::predicted_length(int ahead) const noexcept {
  return rounded(predicted_[static_cast<std::size_t>(std::min(ahead, kPredictedCycles - 1))]);
}
Duration CardiacClock::length_deviation() const noexcept { return rounded(running_deviation_); }

Duration CardiacClock::last_rr() const noexcept {
  return held_ > 1 && beat(0).index_in_run > 0 ? beat(0).time - beat(1).time : Duration::zero();
}

Duration CardiacClock::predicted_r_peak_deviation() const noexcept {
  const double premature = unheard() ? premature_deviation_.count() : 0.0;
  return from_seconds(std::hypot(to_seconds(anchor_deviation()), running_deviation_.count(), premature));
}

}  // namespace perimap

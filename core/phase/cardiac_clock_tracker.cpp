#include "core/phase/cardiac_clock_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace perimap {
namespace {

// 240 beats per minute, beyond any rhythm that the heart's motion can be followed in.
constexpr Duration kShortestRr = std::chrono::milliseconds(250);

// An interval further than this share from its prediction is no part of the rhythm: an ectopic beat, the pause after
// it, or a missed beat. Premature beats come 25 % early and more; breathing moves resting rhythm by less than 15 %.
constexpr double kRhythmTolerance = 0.2;

// By which share of a cycle a premature beat is early, about.
constexpr double kPrematureBy = 0.3;

}  // namespace

CardiacClockTracker::CardiacClockTracker(const CardiacClockSettings& settings) noexcept
    : predictor_(settings.predictor, settings.autoregression) {
  clock_.law_.settings = settings.law;
  clock_.detector_delay_ = settings.detector_delay;
  clock_.lost_after_ = settings.lost_after;
}

void CardiacClockTracker::on_r_peak(const RPeak& peak) noexcept {
  if (peak.beat_class == BeatClass::kNoise) return;
  CardiacClock::Beat beat;
  beat.beat_class = peak.beat_class;
  beat.time = peak.time;
  beat.deviation = peak.deviation;
  if (clock_.held_ > 0) {
    const Duration rr = peak.time - clock_.anchor();
    if (rr < kShortestRr) return;
    const Seconds predicted = clock_.predicted_[0];
    const Duration missed = from_seconds(std::abs((Seconds(rr) - predicted).count()));
    const bool in_rhythm = predictor_.count() > 0 && Seconds(missed) <= kRhythmTolerance * predicted;
    const bool gap = rr > clock_.predicted_length() + clock_.lost_after_;
    if (gap) rhythm_.clear();
    // Over an interruption beats may have been missed: the interval is one when it is as long as it should be.
    if (!gap && (in_rhythm || !unheard_)) {
      beat.index_in_run = clock_.beat(0).index_in_run + 1;
      beat.resumed = clock_.beat(0).resumed;
      if (predictor_.count() > 0 && !in_rhythm) beat.irregularity = missed;
      const BeatClass begin = clock_.beat(0).beat_class;
      const bool normal = cycle_teaches(begin, peak.beat_class) && !unheard_;
      if (normal) {
        predictor_.push(rr);
      } else if (begin != BeatClass::kPremature) {
        predictor_.score(rr);
      }
      if (!peak.unusual_shape && !last_unusual_) rhythm_.push(rr);
      ectopic_.push(rr, begin, peak.beat_class);
      beat.teaches = normal || (ectopic_.prevails() && begin != BeatClass::kPremature && !unheard_);
    } else {
      beat.resumed = !gap && predictor_.count() > 0;
    }
  }
  unheard_ = false;

  clock_.push(beat);
  ++clock_.beats_;
  last_unusual_ = peak.unusual_shape;
  const bool ectopic = ectopic_.prevails() && rhythm_.rhythm() != Rhythm::kUnpredictable;
  clock_.rhythm_ = ectopic ? Rhythm::kEctopic : rhythm_.rhythm();
  predict();
}

// The normal rhythm, but for the pause after a premature beat.
void CardiacClockTracker::predict() noexcept {
  predictor_.predict(clock_.predicted_);
  clock_.length_deviation_ = predictor_.deviation();
  clock_.running_deviation_ = clock_.length_deviation_;
  clock_.next_deviation_ = clock_.length_deviation_;
  clock_.premature_deviation_ = std::sqrt(premature_share()) * kPrematureBy * clock_.predicted_[0];
  if (clock_.beat(0).beat_class != BeatClass::kPremature) return;
  const PredictedLength pause = ectopic_.predict_pause(Seconds(clock_.last_rr()), clock_.predicted_[0]);
  clock_.predicted_[0] = pause.length;
  clock_.running_deviation_ = pause.deviation;
}

// Of the beats known. Jeffreys' estimate: none among them does not mean that there is never one.
double CardiacClockTracker::premature_share() const noexcept {
  const auto begin = clock_.history_.begin();
  const auto premature = std::count_if(begin, begin + clock_.held_, [](const CardiacClock::Beat& beat) {
    return beat.beat_class == BeatClass::kPremature;
  });
  return (static_cast<double>(premature) + 0.5) / (clock_.held_ + 1.0);
}

void CardiacClockTracker::heard(Instant until) noexcept {
  clock_.samples_ = true;
  clock_.interrupted_ = false;
  clock_.heard_until_ = until;
}

void CardiacClockTracker::interrupt() noexcept {
  clock_.interrupted_ = true;
  unheard_ = true;
}

}  // namespace perimap

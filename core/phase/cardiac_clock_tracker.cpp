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

}  // namespace

CardiacClockTracker::CardiacClockTracker(const CardiacClockSettings& settings) noexcept
    : predictor_(settings.predictor, settings.autoregression) {
  clock_.law_ = settings.law;
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
    const bool gap = rr > clock_.predicted_length() + clock_.lost_after_;
    if (gap) {
      rhythm_.clear();
    } else {
      beat.index_in_run = clock_.beat(0).index_in_run + 1;
      if (predictor_.count() > 0) {
        const Seconds predicted = clock_.predicted_[0];
        const Duration missed = from_seconds(std::abs((Seconds(rr) - predicted).count()));
        if (Seconds(missed) > kRhythmTolerance * predicted) beat.irregularity = missed;
      }
      const bool teaches = cycle_teaches(clock_.beat(0).beat_class, peak.beat_class);
      if (teaches) {
        predictor_.push(rr);
      } else {
        predictor_.score(rr);
      }
      if (!peak.unusual_shape && !last_unusual_) rhythm_.push(rr);
    }
  }

  std::copy_backward(clock_.history_.begin(), clock_.history_.end() - 1, clock_.history_.end());
  clock_.history_[0] = beat;
  clock_.held_ = std::min(clock_.held_ + 1, static_cast<int>(clock_.history_.size()));
  ++clock_.beats_;
  predictor_.predict(clock_.predicted_);
  last_unusual_ = peak.unusual_shape;
  clock_.rhythm_ = rhythm_.rhythm();
  clock_.length_deviation_ = predictor_.deviation();
  clock_.running_deviation_ = clock_.length_deviation_;
  clock_.next_deviation_ = clock_.length_deviation_;
}

}  // namespace perimap

#include "core/phase/r_peak_detector.hpp"

#include <chrono>

namespace perimap {
namespace {

// More than the filters' delay and the stretch behind a QRS complex.
constexpr Duration kPadding = std::chrono::milliseconds(200);

}  // namespace

RPeakDetector::RPeakDetector(const RPeakDetectorSettings& settings) noexcept
    : settings_(settings),
      line_(settings.line),
      levels_(settings.levels),
      finder_(settings_.candidates, filter_),
      decision_(settings_.decision, levels_) {
  filter_.restart(Duration::zero());
}

std::optional<RPeak> RPeakDetector::push(Instant t, float mV) noexcept {
  line_.set_excursions(decision_.beats().excursions());
  line_.push(t, mV, Sink{*this});
  return decision_.pop();
}

void RPeakDetector::lead_off(Instant t) noexcept { line_.lead_off(t, Sink{*this}); }

void RPeakDetector::take_sample(Instant t, double mV, bool made_up) noexcept {
  newest_ = line_.newest();
  filter_.push(t, mV, made_up);
  const bool learning = decision_.learning(newest_);
  if (learning && !learning_) {
    levels_.forget_top(decision_.beats_came());
    decision_.fall_silent();
  }
  if (decision_.as_before()) levels_.recall_top();
  learning_ = learning;
  levels_.follow(filter_, decision_.beats().slope(), decision_.in_burst(newest_));
  if (t < levels_.rough_until()) decision_.burst();
  finder_.follow(decision_.clusters(), decision_.beats().polarity(), levels_.quiet(),
                 [&](const QrsCandidate& candidate) {
                   if (levels_.rough(candidate.time)) return;
                   decision_.consider(candidate, settings_.candidates.one_complex, newest_);
                 });
  decision_.decide(ending_ ? newest_ : t, false);
}

// The signal is taken to stand still after its end, so that what is on its way through the filters comes out.
std::optional<RPeak> RPeakDetector::flush() noexcept {
  if (line_.started()) {
    const Instant end = line_.newest();
    const auto value = static_cast<double>(line_.newest_mV());
    const int padding = filter_.samples_in(kPadding);
    ending_ = true;
    for (int i = 1; i <= padding; ++i) take_sample(end + i * line_.period(), value, true);
    decision_.decide(end, true);
    ending_ = false;
    line_.restart();
    restart();
  }
  return decision_.pop();
}

void RPeakDetector::restart() noexcept {
  filter_.restart(line_.period());
  levels_.restart();
  finder_.restart();
  decision_.restart(line_.newest());
}

void RPeakDetector::forget() noexcept {
  filter_.forget();
  levels_.forget();
  decision_.forget();
}

void RPeakDetector::set_period(Duration period) noexcept {
  filter_.restart(period);
  if (period < EcgFilter::kShortestPeriod || period > EcgFilter::kLongestPeriod) return;
  finder_.set_period(period);
  decision_.restart(line_.newest());
}

EcgSignal RPeakDetector::signal() const noexcept {
  if (line_.interrupted()) return line_.interruption();
  if (decision_.chaotic(newest_)) return EcgSignal::kLeadOff;
  // A pause, or a lead that came off: what is unusual beside it tells.
  const bool overdue = decision_.overdue(newest_);
  if (overdue && line_.still_for() > settings_.decision.chaos_after) return EcgSignal::kFlat;
  if (decision_.learning(newest_)) return EcgSignal::kLearning;
  if (overdue && levels_.rougher_than_usual()) return EcgSignal::kNoisy;
  return decision_.noisy(newest_) || newest_ < levels_.rough_until() ? EcgSignal::kNoisy : EcgSignal::kGood;
}

}  // namespace perimap

#include "core/phase/breath_detector.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/phase/seconds.hpp"

namespace perimap {
namespace {

constexpr Duration kBin = std::chrono::milliseconds(50);
constexpr Duration kMissing = std::chrono::milliseconds(500);  // between two samples
constexpr double kTurn = 0.3;                                  // of the range of the last seconds
constexpr double kAgrees = 0.25;                               // of a period
constexpr double kShortestShare = 0.7;    // of the shortest period: noise turns faster than anyone breathes
constexpr double kOverdue = 1.5;          // periods since the last onset
constexpr double kFirstDeviation = 0.05;  // of a period
constexpr double kLeastDeviation_s = 0.02;
constexpr double kKeep = 0.7;  // of the variance, at each period

}  // namespace

bool BreathSignal::heard(Instant now) const noexcept { return onsets > 0 && now - heard_until <= kMissing; }

bool BreathSignal::known(Instant now) const noexcept {
  return period > Duration::zero() && heard(now) && Seconds(now - onset) <= kOverdue * Seconds(period);
}

double BreathSignal::phase_at(Instant t) const noexcept {
  return 2.0 * std::numbers::pi * (Seconds(t - onset) / Seconds(period));
}

void BreathDetector::push(Instant t, double value) noexcept {
  if (!std::isfinite(value)) {
    interrupt();
    return;
  }
  if (any_ && t - signal_.heard_until > kMissing) interrupt();
  if (any_ && t <= signal_.heard_until) return;
  signal_.heard_until = t;
  if (bin_count_ > 0 && t - bin_begin_ >= kBin) {
    add({bin_begin_ + bin_time_ / bin_count_, bin_value_ / bin_count_});
    bin_count_ = 0;
  }
  if (bin_count_ == 0) {
    bin_begin_ = t;
    bin_time_ = Duration::zero();
    bin_value_ = 0.0;
  }
  bin_time_ += t - bin_begin_;
  bin_value_ += value;
  ++bin_count_;
  if (!any_) {
    any_ = true;
    last_ = trough_ = peak_ = {t, value};
    range_begin_ = t;
    range_count_ = 1;
    ranges_[0] = {value, value};
  }
}

void BreathDetector::interrupt() noexcept {
  any_ = false;
  bin_count_ = 0;
  rising_ = false;
  begun_ = false;
  in_breath_ = false;
  signal_.period = Duration::zero();
  agreed_ = 0;
}

void BreathDetector::add(const Point& point) noexcept {
  follow_range(point);
  const auto held = std::min<std::uint64_t>(range_count_, kRangeSeconds);
  Range all = ranges_[0];
  for (std::size_t i = 1; i < held; ++i) {
    all.lowest = std::min(all.lowest, ranges_[i].lowest);
    all.highest = std::max(all.highest, ranges_[i].highest);
  }
  const double turn = kTurn * (all.highest - all.lowest);
  if (rising_) {
    if (point.value > peak_.value) peak_ = point;
    look_for_onset(point);
    if (turn > 0.0 && point.value < peak_.value - turn) {
      rises_.push(peak_.value - trough_.value);
      rising_ = false;
      trough_ = point;
    }
  } else {
    if (point.value < trough_.value) trough_ = point;
    if (turn > 0.0 && point.value > trough_.value + turn) {
      rising_ = true;
      begun_ = false;
      peak_ = point;
      look_for_onset(point);
    }
  }
  last_ = point;
  const Seconds longest =
      signal_.period > Duration::zero() ? Seconds(signal_.period) : Seconds(settings_.longest_period);
  if (in_breath_ && Seconds(point.time - signal_.onset) > kOverdue * longest) {
    in_breath_ = false;
    forget_period();
  }
}

void BreathDetector::follow_range(const Point& point) noexcept {
  if (point.time - range_begin_ >= std::chrono::seconds(1)) {
    range_begin_ = point.time;
    ranges_[range_count_++ % kRangeSeconds] = {point.value, point.value};
  }
  Range& newest = ranges_[(range_count_ - 1) % kRangeSeconds];
  newest.lowest = std::min(newest.lowest, point.value);
  newest.highest = std::max(newest.highest, point.value);
}

void BreathDetector::look_for_onset(const Point& point) noexcept {
  if (begun_ || rises_.count() == 0) return;
  const double level = trough_.value + 0.5 * rises_.median();
  if (point.value < level) return;
  begun_ = true;
  // A trough that was only found above the level has its breath at once.
  const double step = point.value - last_.value;
  const double share = step > 0.0 ? std::clamp((level - last_.value) / step, 0.0, 1.0) : 1.0;
  begin_breath(last_.time + from_seconds(share * to_seconds(point.time - last_.time)));
}

void BreathDetector::begin_breath(Instant onset) noexcept {
  ++signal_.onsets;
  const double period_s = to_seconds(onset - signal_.onset);
  signal_.onset = onset;
  if (!in_breath_) {
    in_breath_ = true;
    return;
  }
  if (period_s < kShortestShare * to_seconds(settings_.shortest_period) ||
      period_s > kOverdue * to_seconds(settings_.longest_period)) {
    forget_period();
    last_period_s_ = 0.0;
    return;
  }
  const bool agrees = last_period_s_ > 0.0 && std::abs(period_s - last_period_s_) <= kAgrees * last_period_s_;
  last_period_s_ = period_s;
  if (!agrees) {
    forget_period();
    periods_s_.push(period_s);
    return;
  }
  if (agreed_++ == 0) {
    const double first_s = kFirstDeviation * period_s;
    variance_s2_ = first_s * first_s;
  } else {
    const double missed_s = period_s - to_seconds(signal_.period);
    variance_s2_ = kKeep * variance_s2_ + (1.0 - kKeep) * missed_s * missed_s;
  }
  periods_s_.push(period_s);
  signal_.period = from_seconds(periods_s_.median());
  signal_.deviation = from_seconds(std::max(std::sqrt(variance_s2_), kLeastDeviation_s));
}

void BreathDetector::forget_period() noexcept {
  signal_.period = Duration::zero();
  periods_s_.clear();
  agreed_ = 0;
}

}  // namespace perimap

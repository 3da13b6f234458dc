// The ECG's line: from stamped values as they come to evenly spaced samples, and where the line is broken.
//
// The sample rate is learnt from the stamps, short gaps are filled in by a straight line, and longer ones, a value that
// stands still and a lead that is off break the line off: what was being looked at is forgotten.
#pragma once

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>

#include "core/phase/ecg_filter.hpp"
#include "core/phase/ecg_signal.hpp"
#include "core/phase/sample_rate.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct EcgLineSettings {
  // So long a stretch of missing samples is filled in: a third of a normal QRS complex, whose peak may lie in it but
  // which does not go unseen. In a longer one a beat may be hidden.
  Duration bridged = std::chrono::milliseconds(30);
  Duration jitter = std::chrono::microseconds(1500);  // of stamps that are rounded to a millisecond
  Duration flat_after = std::chrono::seconds(1);      // a converter repeats itself for a fraction of that in diastole
  double hardly = 0.03;  // of the beats' excursions: the last bits of an amplifier at its limit,
  Duration hardly_after = std::chrono::milliseconds(2500);  // for longer than a diastole lasts at 30 beats a minute
  Duration forget_after = std::chrono::seconds(30);         // of interruption: by then the electrode sits elsewhere
  Duration recalled = std::chrono::milliseconds(200);  // of a flat line, so that what comes out of it is seen to rise
};

class EcgLine {
 public:
  explicit EcgLine(const EcgLineSettings& settings = {}) noexcept : settings_(settings) {}

  // The next value. `sink` has sample(Instant, double mV, bool made_up) for each even sample that it gives, break_off()
  // where the line breaks off, forget() where all that was learnt is of another signal, and rate(Duration) where the
  // sample period becomes known, before the samples of that period.
  template <class Sink>
  void push(Instant t, float mV, Sink&& sink) noexcept;
  template <class Sink>
  void lead_off(Instant t, Sink&& sink) noexcept {
    newest_ = t > newest_ ? t : newest_;
    interrupt(newest_, EcgSignal::kLeadOff, sink);
  }
  // The signal has ended, or begins anew without having been away.
  void restart() noexcept {
    started_ = false;
    first_count_ = 0;
    rate_.interrupt();
  }

  void set_excursions(double mV) noexcept { excursions_mV_ = mV; }  // of the beats, from top to bottom

  [[nodiscard]] bool started() const noexcept { return started_; }
  [[nodiscard]] bool interrupted() const noexcept { return interrupted_; }
  [[nodiscard]] EcgSignal interruption() const noexcept { return interruption_; }
  [[nodiscard]] std::uint64_t interruptions() const noexcept { return interruptions_; }
  [[nodiscard]] Duration period() const noexcept { return period_; }
  [[nodiscard]] Instant newest() const noexcept { return newest_; }
  [[nodiscard]] float newest_mV() const noexcept { return newest_mV_; }
  // For how long the value has hardly changed, by the beats' measure.
  [[nodiscard]] Duration still_for() const noexcept { return newest_ - left_at_; }

 private:
  template <class Sink>
  void interrupt(Instant t, EcgSignal reason, Sink& sink) noexcept;
  template <class Sink>
  void learn_rate(Instant t, float mV, Sink& sink) noexcept;
  template <class Sink>
  void bridge(Instant from, float from_mV, Instant to, float to_mV, Sink& sink) noexcept;
  template <class Sink>
  void recall(Instant until, float mV, Sink& sink) noexcept;
  template <class Sink>
  void give(Instant t, double mV, bool made_up, Sink& sink) noexcept;
  [[nodiscard]] bool stands_still(Instant t, float mV, bool anew) noexcept;

  EcgLineSettings settings_;
  SampleRate rate_;
  Duration period_{0};  // that is used; zero until known
  std::array<Instant, 17> first_times_{};
  std::array<float, 17> first_values_{};
  int first_count_ = 0;
  bool started_ = false;
  std::uint64_t interruptions_ = 0;
  bool interrupted_ = false;
  EcgSignal interruption_ = EcgSignal::kLeadOff;
  Instant interrupted_at_;
  Instant newest_;
  float newest_mV_ = 0.0F;
  Instant changed_at_;  // when the value last changed,
  Instant left_at_;     // and when it last left the surroundings of
  double level_mV_ = 0.0;
  double excursions_mV_ = 0.0;
};

template <class Sink>
void EcgLine::push(Instant t, float mV, Sink&& sink) noexcept {
  const bool first = !started_ && !interrupted_ && first_count_ == 0;
  if (!std::isfinite(mV)) {
    if (first || t - newest_ > settings_.bridged) lead_off(t, sink);
    return;
  }
  if (!first && t <= newest_) return;
  if (!first && !interrupted_ && t - newest_ > settings_.bridged) interrupt(newest_, EcgSignal::kLeadOff, sink);
  if (stands_still(t, mV, first || (interrupted_ && interruption_ != EcgSignal::kFlat))) {
    newest_ = t;
    newest_mV_ = mV;
    interrupt(changed_at_ < left_at_ ? changed_at_ : left_at_, EcgSignal::kFlat, sink);
    return;
  }
  const bool was_flat = interrupted_ && interruption_ == EcgSignal::kFlat && t - newest_ <= settings_.bridged;
  if (interrupted_) {
    interrupted_ = false;
    if (t - interrupted_at_ > settings_.forget_after) {
      sink.forget();
      period_ = Duration::zero();
      rate_ = SampleRate();
    }
  }
  const Instant before = newest_;
  const float before_mV = newest_mV_;
  newest_ = t;
  newest_mV_ = mV;
  rate_.push(t);
  if (period_ > Duration::zero() && rate_.contradicts(period_)) {
    ++interruptions_;
    period_ = Duration::zero();
    sink.forget();
    restart();
    sink.break_off();
  }
  if (period_ == Duration::zero()) {
    learn_rate(t, mV, sink);
    return;
  }
  if (was_flat) recall(before, before_mV, sink);
  if (started_) bridge(before, before_mV, t, mV, sink);
  give(t, static_cast<double>(mV), false, sink);
}

template <class Sink>
void EcgLine::interrupt(Instant t, EcgSignal reason, Sink& sink) noexcept {
  interruption_ = reason;
  if (interrupted_) return;
  interrupted_ = true;
  ++interruptions_;
  interrupted_at_ = t;
  restart();
  sink.break_off();
}

// The values that tell the rate are taken once it is known.
template <class Sink>
void EcgLine::learn_rate(Instant t, float mV, Sink& sink) noexcept {
  if (first_count_ < static_cast<int>(first_times_.size())) {
    first_times_[static_cast<std::size_t>(first_count_)] = t;
    first_values_[static_cast<std::size_t>(first_count_)] = mV;
    ++first_count_;
  }
  if (rate_.period() == Duration::zero()) return;
  period_ = rate_.period();
  sink.rate(period_);
  for (int i = 0; i < first_count_; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (i > 0) bridge(first_times_[at - 1], first_values_[at - 1], first_times_[at], first_values_[at], sink);
    give(first_times_[at], static_cast<double>(first_values_[at]), false, sink);
  }
}

// The samples between two, where some are missing.
template <class Sink>
void EcgLine::bridge(Instant from, float from_mV, Instant to, float to_mV, Sink& sink) noexcept {
  const Duration step = to - from;
  if (step <= period_ + settings_.jitter) return;
  const auto steps = static_cast<int>((step + period_ / 2) / period_);
  for (int i = 1; i < steps; ++i) {
    const float share = static_cast<float>(i) / static_cast<float>(steps);
    give(from + i * step / steps, static_cast<double>(from_mV + share * (to_mV - from_mV)), true, sink);
  }
}

// The last of the flat line.
template <class Sink>
void EcgLine::recall(Instant until, float mV, Sink& sink) noexcept {
  const auto samples = static_cast<int>(settings_.recalled / period_);
  for (int i = samples - 1; i >= 0; --i) give(until - i * period_, static_cast<double>(mV), true, sink);
}

template <class Sink>
void EcgLine::give(Instant t, double mV, bool made_up, Sink& sink) noexcept {
  if (period_ < EcgFilter::kShortestPeriod || period_ > EcgFilter::kLongestPeriod) return;
  started_ = true;
  sink.sample(t, mV, made_up);
}

}  // namespace perimap

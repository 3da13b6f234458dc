#include "core/pipeline/ecg_intake.hpp"

#include <cstddef>
#include <limits>
#include <optional>
#include <span>

#include "core/realtime/realtime_scope.hpp"

namespace perimap {

void EcgIntake::push(const EcgBlock& block) noexcept {
  const RealtimeScope realtime;
  if (!trigger_) forget_when_asked();
  count(block);
  if (trigger_) return;
  // What does not fit is missing after a restart alone.
  static_cast<void>(heard_.push(block));
  const std::uint64_t before = repeated_samples();
  hear(without_repeated(block));
  counters_.ecg_repeated.add(repeated_samples() - before);
}

void EcgIntake::recall(const EcgBlock& block) noexcept {
  if (!trigger_) hear(without_repeated(block));
}

void EcgIntake::count(const EcgBlock& block) noexcept {
  const std::uint64_t lost = sample_count_.lost_before(block.device_sequence, block.count);
  if (lost > 0) counters_.ecg_dropped.add(lost);
  counters_.ecg_samples.add(block.count);
  if (block.count > 0) {
    const Instant last = block.last_sample_time();
    counters_.ecg_delay.add(block.arrival - last);
    counters_.last_ecg_ns.set(static_cast<std::uint64_t>(to_ns(last)));
  }
  if (block.nothing_heard()) counters_.ecg_lead_off.add(block.count);
}

// A lead that gives what it gave seconds before is off.
EcgBlock EcgIntake::without_repeated(const EcgBlock& block) noexcept {
  if (settings_.may_loop) return block;
  const auto hear_lead = [&block](RepeatedSamples& lead, std::span<const float> samples, bool off) {
    if (off) lead.interrupt();
    for (std::size_t i = 0; i < samples.size() && !off; ++i) lead.add(samples[i], block.sample_period);
    return off || lead.told();
  };
  EcgBlock believed = block;
  believed.lead_off = hear_lead(repeated_[0], block.samples(), block.lead_off);
  believed.second_off = hear_lead(repeated_[1], block.second_samples(), block.second_off);
  return believed;
}

void EcgIntake::hear(const EcgBlock& block) noexcept {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  std::uint64_t flat = 0;
  Instant t = block.first_sample_time;
  if (block.nothing_heard()) beats_.lead_off(t);
  for (std::size_t i = 0; i < block.count && !block.nothing_heard(); ++i) {
    const float mV = block.lead_off ? kNone : block.mV[i];
    const float second_mV = block.second_off ? kNone : block.second_mV[i];
    const std::optional<RPeak> peak = block.has_second ? beats_.push(t, mV, second_mV) : beats_.push(t, mV);
    if (peak) tracker_.on_r_peak(*peak);
    if (beats_.take_interruption()) tracker_.interrupt();
    if (beats_.signal() == EcgSignal::kFlat) ++flat;
    t += block.sample_period;
  }
  if (flat > 0) counters_.ecg_lead_off.add(flat);
  tell_of_leads(block);
  const EcgSignal signal = beats_.signal();
  if (signal == EcgSignal::kFlat || signal == EcgSignal::kLeadOff) {
    tracker_.interrupt();
  } else if (block.count > 0) {
    const Instant until = block.last_sample_time();
    tracker_.heard(until);
    counters_.last_good_ecg_ns.set(static_cast<std::uint64_t>(to_ns(until)));
  }
  publish();
}

void EcgIntake::tell_of_leads(const EcgBlock& block) noexcept {
  const auto told = [](EcgSignal signal) { return 1 + static_cast<std::uint64_t>(signal); };
  const auto told_of = [this](std::size_t lead, EcgSignal signal) {
    return repeated_[lead].told() ? EcgSignal::kRepeated : signal;
  };
  counters_.ecg_leads[0].set(told(told_of(0, beats_.signal(0))));
  // A second one that has never been heard has no detector that could say so.
  const EcgSignal second = beats_.two_leads() ? beats_.signal(1) : EcgSignal::kLeadOff;
  counters_.ecg_leads[1].set(block.has_second ? told(told_of(1, second)) : 0);
}

void EcgIntake::push(const RTriggerPulse& pulse) noexcept {
  const RealtimeScope realtime;
  const std::uint64_t lost = pulse_count_.lost_before(pulse.device_count, 1);
  if (lost > 0) counters_.r_triggers_dropped.add(lost);
  counters_.r_triggers.add();
  counters_.r_trigger_delay.add(pulse.arrival - pulse.time);
  counters_.last_r_trigger_ns.set(static_cast<std::uint64_t>(to_ns(pulse.time)));
  if (!trigger_) return;
  forget_when_asked();
  const std::optional<RPeak> peak = trigger_->push(pulse.time, pulse.arrival);
  if (!peak) return;
  tracker_.on_r_peak(trigger_classer_.classify(*peak));
  publish();
}

void EcgIntake::forget_when_asked() noexcept {
  if (!forget_asked_.exchange(false, std::memory_order_relaxed)) return;
  beats_.restart();
  if (trigger_) trigger_.emplace(*settings_.r_trigger);
  trigger_classer_ = BeatClasser();
  tracker_ = CardiacClockTracker(settings_.clock);
  publish();
}

void EcgIntake::publish() noexcept {
  cells_.mapper.write(tracker_.clock());
  cells_.publisher.write(tracker_.clock());
  cells_.status.write(tracker_.clock());
}

}  // namespace perimap

#include "core/pipeline/ecg_intake.hpp"

#include <chrono>
#include <optional>

#include "core/realtime/realtime_scope.hpp"

namespace perimap {
namespace {

// Between two blocks: shorter than this no beat is hidden.
constexpr Duration kMissing = std::chrono::milliseconds(100);

}  // namespace

void EcgIntake::push(const EcgBlock& block) noexcept {
  const RealtimeScope realtime;
  if (!trigger_) forget_when_asked();
  count(block);
  if (trigger_) return;
  // What does not fit is missing after a restart alone.
  static_cast<void>(heard_.push(block));
  hear(block);
}

void EcgIntake::recall(const EcgBlock& block) noexcept {
  if (!trigger_) hear(block);
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
  if (block.lead_off) counters_.ecg_lead_off.add(block.count);
}

void EcgIntake::hear(const EcgBlock& block) noexcept {
  if (block.lead_off) {
    detector_.lead_off(block.first_sample_time);
    interrupt();
    publish();
    return;
  }
  if (any_heard_ && block.first_sample_time - heard_until_ > kMissing) interrupt();
  std::uint64_t flat = 0;
  Instant t = block.first_sample_time;
  for (const float mV : block.samples()) {
    if (const std::optional<RPeak> peak = detector_.push(t, mV)) tracker_.on_r_peak(classer_.classify(*peak));
    if (detector_.signal() == EcgSignal::kFlat) ++flat;
    heard_until_ = t;
    t += block.sample_period;
  }
  any_heard_ = true;
  if (flat > 0) counters_.ecg_lead_off.add(flat);
  const EcgSignal signal = detector_.signal();
  if (signal == EcgSignal::kFlat || signal == EcgSignal::kLeadOff) {
    interrupt();
  } else {
    tracker_.heard(heard_until_);
    counters_.last_good_ecg_ns.set(static_cast<std::uint64_t>(to_ns(heard_until_)));
  }
  publish();
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
  tracker_.on_r_peak(classer_.classify(*peak));
  publish();
}

void EcgIntake::interrupt() noexcept {
  classer_.interrupt();
  tracker_.interrupt();
}

void EcgIntake::forget_when_asked() noexcept {
  if (!forget_asked_.exchange(false, std::memory_order_relaxed)) return;
  detector_ = RPeakDetector();
  if (trigger_) trigger_.emplace(*settings_.r_trigger);
  classer_ = BeatClasser();
  tracker_ = CardiacClockTracker(settings_.clock);
  any_heard_ = false;
  publish();
}

void EcgIntake::publish() noexcept {
  cells_.mapper.write(tracker_.clock());
  cells_.publisher.write(tracker_.clock());
  cells_.status.write(tracker_.clock());
}

}  // namespace perimap

#include "core/pipeline/ecg_intake.hpp"

#include <optional>

#include "core/realtime/realtime_scope.hpp"

namespace perimap {

void EcgIntake::push(const EcgBlock& block) noexcept {
  const RealtimeScope realtime;
  // The count wraps, and starts over with the device: only a step forward is a loss.
  const auto step = static_cast<std::int32_t>(block.device_sequence - next_device_sequence_);
  if (started_ && step > 0) counters_.ecg_dropped.add(static_cast<std::uint64_t>(step));
  started_ = true;
  next_device_sequence_ = block.device_sequence + block.count;
  counters_.ecg_samples.add(block.count);
  if (block.count > 0) {
    const Instant last = block.first_sample_time + (block.count - 1) * block.sample_period;
    counters_.ecg_delay.add(block.arrival - last);
    counters_.last_ecg_ns.set(static_cast<std::uint64_t>(to_ns(last)));
  }
  if (block.lead_off) {
    counters_.ecg_lead_off.add(block.count);
    detector_.lead_off(block.first_sample_time);
    classer_.interrupt();
    return;
  }
  bool changed = false;
  std::uint64_t flat = 0;
  Instant t = block.first_sample_time;
  for (const float mV : block.samples()) {
    if (const std::optional<RPeak> peak = detector_.push(t, mV)) {
      tracker_.on_r_peak(classer_.classify(*peak));
      changed = true;
    }
    if (detector_.signal() == EcgSignal::kFlat) ++flat;
    t += block.sample_period;
  }
  if (flat > 0) counters_.ecg_lead_off.add(flat);
  if (changed) publish();
}

void EcgIntake::publish() noexcept {
  cells_.mapper.write(tracker_.clock());
  cells_.publisher.write(tracker_.clock());
  cells_.status.write(tracker_.clock());
}

}  // namespace perimap

#include "drivers/ecg/ecg_assembler.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace perimap {

EcgAssembler::EcgAssembler(const ArrivalClockSettings& clock, EcgSink sink, DeviceHealth& health)
    : clock_(clock), sink_(std::move(sink)), health_(health) {}

void EcgAssembler::restart() noexcept {
  clock_.reset();
  chunk_.clear();
  any_ = false;
}

void EcgAssembler::add(float mV, bool lead_off, std::uint64_t lost) {
  next_count_ += static_cast<std::int64_t>(lost);
  health_.lost.add(lost);
  chunk_.push_back({next_count_++, mV, lead_off});
}

std::uint64_t EcgAssembler::lost_samples(std::uint64_t lost_modulo, std::uint64_t modulus, std::size_t behind,
                                         Instant now) const noexcept {
  if (!clock_.started()) return lost_modulo;
  const double by_time = clock_.count_at(now) - static_cast<double>(behind) - static_cast<double>(next_count_);
  const double rounds = std::floor((by_time - static_cast<double>(lost_modulo)) / static_cast<double>(modulus) + 0.25);
  // An hour of gap would have closed the link.
  return lost_modulo + modulus * static_cast<std::uint64_t>(std::clamp(rounds, 0.0, 1e6));
}

void EcgAssembler::end_chunk(Instant arrival) {
  if (chunk_.empty()) return;
  clock_.observe(chunk_.back().count, arrival);
  health_.jitter.add(clock_.lateness(chunk_.back().count, arrival));
  last_arrival_ = arrival;
  any_ = true;
  EcgBlock block;
  block.arrival = arrival;
  block.sample_period = Duration(std::llround(clock_.period_ns()));
  for (std::size_t i = 0; i < chunk_.size(); ++i) {
    const Sample& sample = chunk_[i];
    if (block.count == 0) {
      // The edge moves back when an earlier arrival is seen; samples do not change their order for it.
      block.first_sample_time = std::min(std::max(clock_.stamp(sample.count), last_stamp_ + Duration(1)), arrival);
      block.device_sequence = static_cast<std::uint32_t>(sample.count);
      block.lead_off = sample.lead_off;
    }
    block.mV[block.count++] = sample.mV;
    const bool last = i + 1 == chunk_.size();
    if (last || block.count == EcgBlock::kCapacity || chunk_[i + 1].count != sample.count + 1 ||
        chunk_[i + 1].lead_off != sample.lead_off) {
      last_stamp_ = block.first_sample_time + (block.count - 1) * block.sample_period;
      health_.samples.add(block.count);
      sink_(block);
      block.count = 0;
    }
  }
  chunk_.clear();
}

}  // namespace perimap

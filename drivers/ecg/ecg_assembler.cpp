#include "drivers/ecg/ecg_assembler.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

namespace perimap {
namespace {

// Breathing is measured once.
template <class Block>
constexpr bool kHasSecondLead = std::is_same_v<Block, EcgBlock>;

bool same_state(const std::optional<SecondLead>& a, const std::optional<SecondLead>& b) noexcept {
  return a.has_value() == b.has_value() && (!a || a->off == b->off);
}

}  // namespace

EcgAssembler::EcgAssembler(const ArrivalClockSettings& clock, EcgSinks sinks, DeviceHealth& health)
    : clock_(clock), sinks_(std::move(sinks)), health_(health) {}

void EcgAssembler::restart() noexcept {
  clock_.reset();
  ecg_.chunk.clear();
  respiration_.chunk.clear();
  any_ = false;
}

void EcgAssembler::add(float mV, bool lead_off, std::uint64_t lost, std::optional<RespirationReading> respiration,
                       std::optional<SecondLead> second) {
  next_count_ += static_cast<std::int64_t>(lost);
  health_.lost.add(lost);
  ecg_.chunk.push_back({next_count_, mV, lead_off, second});
  if (respiration && sinks_.respiration) {
    respiration_.chunk.push_back({next_count_, respiration->value, respiration->sensor_off});
  }
  ++next_count_;
}

std::uint64_t EcgAssembler::lost_samples(std::uint64_t lost_modulo, std::uint64_t modulus, std::size_t behind,
                                         Instant now) const noexcept {
  if (!clock_.started()) return lost_modulo;
  const double by_time = clock_.count_at(now) - static_cast<double>(behind) - static_cast<double>(next_count_);
  const double rounds = std::floor((by_time - static_cast<double>(lost_modulo)) / static_cast<double>(modulus) + 0.25);
  // An hour of gap would have closed the link.
  return lost_modulo + modulus * static_cast<std::uint64_t>(std::clamp(rounds, 0.0, 1e6));
}

template <class Block>
void EcgAssembler::give(Lane& lane, Instant arrival, std::array<float, Block::kCapacity> Block::*values,
                        bool Block::*off, const std::function<void(const Block&)>& sink) {
  Block block;
  block.arrival = arrival;
  block.sample_period = Duration(std::llround(clock_.period_ns()));
  for (std::size_t i = 0; i < lane.chunk.size(); ++i) {
    const Sample& sample = lane.chunk[i];
    if (block.count == 0) {
      // The edge moves back when an earlier arrival is seen; samples do not change their order for it.
      block.first_sample_time = std::min(std::max(clock_.stamp(sample.count), lane.last_stamp + Duration(1)), arrival);
      block.device_sequence = static_cast<std::uint32_t>(sample.count);
      block.*off = sample.off;
      if constexpr (kHasSecondLead<Block>) {
        block.has_second = sample.second.has_value();
        block.second_off = sample.second && sample.second->off;
      }
    }
    if constexpr (kHasSecondLead<Block>) {
      if (sample.second) block.second_mV[block.count] = sample.second->mV;
    }
    (block.*values)[block.count++] = sample.value;
    const bool last = i + 1 == lane.chunk.size();
    if (last || block.count == Block::kCapacity || lane.chunk[i + 1].count != sample.count + 1 ||
        lane.chunk[i + 1].off != sample.off || !same_state(lane.chunk[i + 1].second, sample.second)) {
      lane.last_stamp = block.last_sample_time();
      sink(block);
      block.count = 0;
    }
  }
  lane.chunk.clear();
}

void EcgAssembler::end_chunk(Instant arrival) {
  if (ecg_.chunk.empty()) return;
  const std::int64_t newest = ecg_.chunk.back().count;
  clock_.observe(newest, arrival);
  health_.jitter.add(clock_.lateness(newest, arrival));
  last_arrival_ = arrival;
  any_ = true;
  health_.samples.add(ecg_.chunk.size());
  give(ecg_, arrival, &EcgBlock::mV, &EcgBlock::lead_off, sinks_.ecg);
  give(respiration_, arrival, &RespirationBlock::values, &RespirationBlock::sensor_off, sinks_.respiration);
}

}  // namespace perimap

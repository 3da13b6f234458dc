// From single samples, in whatever chunks they are read, to stamped blocks.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/sensors/ecg_block.hpp"
#include "drivers/device/arrival_clock.hpp"
#include "drivers/device/device_health.hpp"

namespace perimap {

using EcgSink = std::function<void(const EcgBlock&)>;

// A protocol gives the samples of one read, then ends the chunk; only then is it known when the newest arrived. A gap
// in the count, or lead-off beginning or ending, begins a new block.
class EcgAssembler {
 public:
  EcgAssembler(const ArrivalClockSettings& clock, EcgSink sink, DeviceHealth& health);

  // A new conversation: the device counts anew and its clock is unknown. Our own count goes on.
  void restart() noexcept;

  // The sample that follows the last one, or comes `lost` samples after it.
  void add(float mV, bool lead_off, std::uint64_t lost = 0);
  // How many samples were lost before one that was read at `now` together with `behind` later ones, when the device's
  // count tells it modulo `modulus`: the time that has passed says how often the count went round.
  [[nodiscard]] std::uint64_t lost_samples(std::uint64_t lost_modulo, std::uint64_t modulus, std::size_t behind,
                                           Instant now) const noexcept;

  // All samples of the read that ended at `arrival` are in. Gives them to the sink.
  void end_chunk(Instant arrival);

  [[nodiscard]] bool any() const noexcept { return any_; }
  [[nodiscard]] Instant last_arrival() const noexcept { return last_arrival_; }

 private:
  struct Sample {
    std::int64_t count;
    float mV;
    bool lead_off;
  };

  ArrivalClock clock_;
  EcgSink sink_;
  DeviceHealth& health_;
  std::vector<Sample> chunk_;
  std::int64_t next_count_ = 0;
  bool any_ = false;  // in this conversation
  Instant last_arrival_{};
  Instant last_stamp_{};
};

}  // namespace perimap

// From single samples of an ECG device, in whatever chunks they are read, to stamped blocks.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "core/sensors/ecg_block.hpp"
#include "core/sensors/respiration_block.hpp"
#include "drivers/device/arrival_clock.hpp"
#include "drivers/device/device_health.hpp"

namespace perimap {

using EcgSink = std::function<void(const EcgBlock&)>;
using RespirationSink = std::function<void(const RespirationBlock&)>;

// Where a device's samples go.
struct EcgSinks {
  // NOLINTNEXTLINE(google-explicit-constructor): most devices measure the ECG alone
  EcgSinks(EcgSink to_ecg, RespirationSink to_respiration = {})
      : ecg(std::move(to_ecg)), respiration(std::move(to_respiration)) {}

  EcgSink ecg;
  RespirationSink respiration;  // none: respiration is passed over
};

// What the device's respiration channel measured together with a sample of the ECG.
struct RespirationReading {
  float value = 0.0F;
  bool sensor_off = false;
};

// What a second lead measured together with a sample of the first.
struct SecondLead {
  float mV = 0.0F;
  bool off = false;
};

// A protocol gives the samples of one read, then ends the chunk; only then is it known when the newest arrived. A gap
// in the count, or lead-off beginning or ending, begins a new block. Respiration has the ECG's count and stamps, and a
// second lead is in the first's blocks.
class EcgAssembler {
 public:
  EcgAssembler(const ArrivalClockSettings& clock, EcgSinks sinks, DeviceHealth& health);

  // A new conversation: the device counts anew and its clock is unknown. Our own count goes on.
  void restart() noexcept;

  // The sample that follows the last one, or comes `lost` samples after it.
  void add(float mV, bool lead_off, std::uint64_t lost = 0, std::optional<RespirationReading> respiration = {},
           std::optional<SecondLead> second = {});
  // How many samples were lost before one that was read at `now` together with `behind` later ones, when the device's
  // count tells it modulo `modulus`: the time that has passed says how often the count went round.
  [[nodiscard]] std::uint64_t lost_samples(std::uint64_t lost_modulo, std::uint64_t modulus, std::size_t behind,
                                           Instant now) const noexcept;

  // All samples of the read that ended at `arrival` are in. Gives them to the sinks.
  void end_chunk(Instant arrival);

  [[nodiscard]] bool any() const noexcept { return any_; }
  // Of the sample that comes next: all that came before it, and those that were lost.
  [[nodiscard]] std::int64_t next_count() const noexcept { return next_count_; }
  [[nodiscard]] Instant last_arrival() const noexcept { return last_arrival_; }

 private:
  struct Sample {
    std::int64_t count = 0;
    float value = 0.0F;
    bool off = false;
    std::optional<SecondLead> second = {};
  };
  // One signal's samples of this chunk.
  struct Lane {
    std::vector<Sample> chunk;
    Instant last_stamp;
  };

  // The lane's chunk, cut into blocks.
  template <class Block>
  void give(Lane& lane, Instant arrival, std::array<float, Block::kCapacity> Block::*values, bool Block::*off,
            const std::function<void(const Block&)>& sink);

  ArrivalClock clock_;
  EcgSinks sinks_;
  DeviceHealth& health_;
  Lane ecg_;
  Lane respiration_;
  std::int64_t next_count_ = 0;
  bool any_ = false;  // in this conversation
  Instant last_arrival_{};
};

}  // namespace perimap

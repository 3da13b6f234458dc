// What the serial ECG protocols share: starting, watching for silence, telling what is wrong.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/device/device_protocol.hpp"
#include "drivers/ecg/ecg_assembler.hpp"

namespace perimap {

// Of bytes on a serial line, 8N1.
[[nodiscard]] constexpr Duration time_on_line(std::size_t bytes, int baud) noexcept {
  return from_seconds(static_cast<double>(bytes) * 10.0 / baud);
}

// A device that says nothing for 300 ms is silent; after 2 s, which is longer than any start takes, the link is opened
// anew, because a device that was switched off has to be started again.
class EcgProtocol : public DeviceProtocol {
 public:
  // `transport_delay`: from a sample's measurement to the earliest that it can be here.
  EcgProtocol(double sample_rate_hz, Duration transport_delay, EcgSinks sinks, DeviceHealth& health);

  void on_open(LinkControl& link, Instant now) final;
  void on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) final;
  void on_time(LinkControl& link, Instant now) final;
  [[nodiscard]] Instant next_time() const noexcept final;

 protected:
  virtual void start(LinkControl& link) = 0;
  // Gives what the bytes hold to samples(). Bytes that fit nowhere are counted as damaged.
  virtual void decode(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) = 0;

  [[nodiscard]] EcgAssembler& samples() noexcept { return samples_; }
  [[nodiscard]] DeviceHealth& health() noexcept { return health_; }

 private:
  EcgAssembler samples_;
  DeviceHealth& health_;
  Instant opened_{};
  std::uint64_t bytes_ = 0;
};

}  // namespace perimap

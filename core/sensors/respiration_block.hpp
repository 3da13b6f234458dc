// A short run of evenly spaced samples of a respiration channel, as it came: impedance, airway pressure, flow or
// volume.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/time/instant.hpp"

namespace perimap {

struct RespirationBlock {
  static constexpr std::size_t kCapacity = 64;

  Instant first_sample_time;
  Instant arrival;
  Duration sample_period{0};
  std::uint32_t device_sequence = 0;  // the device's count of the first sample
  std::uint32_t count = 0;
  bool sensor_off = false;                // the samples mean nothing
  std::array<float, kCapacity> values{};  // any unit, inspiration either way

  [[nodiscard]] std::span<const float> samples() const noexcept { return {values.data(), count}; }
};

}  // namespace perimap

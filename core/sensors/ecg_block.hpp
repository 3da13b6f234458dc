// A short run of evenly spaced ECG samples of one lead, as it came.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/time/instant.hpp"

namespace perimap {

struct EcgBlock {
  static constexpr std::size_t kCapacity = 64;

  Instant first_sample_time;
  Instant arrival;
  Duration sample_period{0};
  std::uint32_t device_sequence = 0;  // the device's count of the first sample
  std::uint32_t count = 0;
  bool lead_off = false;  // the samples mean nothing
  std::array<float, kCapacity> mV{};

  [[nodiscard]] std::span<const float> samples() const noexcept { return {mV.data(), count}; }
};

}  // namespace perimap

// A short run of evenly spaced samples of a respiration channel, as it came: impedance, airway pressure, flow or
// volume.
#pragma once

#include <array>
#include <span>

#include "core/sensors/sample_block.hpp"

namespace perimap {

struct RespirationBlock : SampleBlock {
  bool sensor_off = false;                // the samples mean nothing
  std::array<float, kCapacity> values{};  // any unit, inspiration either way

  [[nodiscard]] std::span<const float> samples() const noexcept { return {values.data(), count}; }
};

}  // namespace perimap

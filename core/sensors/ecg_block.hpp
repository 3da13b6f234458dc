// A short run of evenly spaced ECG samples of one lead, as it came.
#pragma once

#include <array>
#include <span>

#include "core/sensors/sample_block.hpp"

namespace perimap {

struct EcgBlock : SampleBlock {
  bool lead_off = false;  // the samples mean nothing
  std::array<float, kCapacity> mV{};

  [[nodiscard]] std::span<const float> samples() const noexcept { return {mV.data(), count}; }
};

}  // namespace perimap

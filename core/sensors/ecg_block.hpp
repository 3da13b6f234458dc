// A short run of evenly spaced ECG samples, as it came: of one lead, or of two that were measured together.
#pragma once

#include <array>
#include <span>

#include "core/sensors/sample_block.hpp"

namespace perimap {

struct EcgBlock : SampleBlock {
  bool lead_off = false;  // the samples mean nothing
  std::array<float, kCapacity> mV{};

  bool has_second = false;  // a second lead
  bool second_off = false;  // its samples mean nothing
  std::array<float, kCapacity> second_mV{};

  // Of no lead do the samples mean anything.
  [[nodiscard]] bool nothing_heard() const noexcept { return lead_off && (!has_second || second_off); }
  [[nodiscard]] std::span<const float> samples() const noexcept { return {mV.data(), count}; }
  [[nodiscard]] std::span<const float> second_samples() const noexcept {
    return {second_mV.data(), has_second ? count : 0};
  }
};

}  // namespace perimap

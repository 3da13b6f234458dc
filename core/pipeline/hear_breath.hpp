// A respiration channel's samples, as they come, to the detector of breaths.
#pragma once

#include "core/phase/breath_detector.hpp"
#include "core/sensors/respiration_block.hpp"

namespace perimap {

inline void hear_breath(const RespirationBlock& block, BreathDetector& detector) noexcept {
  if (block.sensor_off) return detector.interrupt();
  for (std::uint32_t i = 0; i < block.count; ++i) {
    detector.push(block.time_of(i), static_cast<double>(block.values[i]));
  }
}

}  // namespace perimap

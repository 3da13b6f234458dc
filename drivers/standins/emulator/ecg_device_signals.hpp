// What an emulated ECG device measures.
#pragma once

#include <limits>
#include <optional>

#include "drivers/standins/emulator/sampled_waveform.hpp"

namespace perimap {

struct EcgDeviceSignals {
  SampledWaveform ecg_mV;
  std::optional<SampledWaveform> respiration = {};  // from -1 to 1, on the inputs beside the ECG's
  std::optional<SampledWaveform> second_mV = {};    // a second lead, on an input of its own

  // None where there is no second lead; not a number: it is off.
  [[nodiscard]] std::optional<float> second_at(Instant t) const noexcept {
    if (!second_mV) return std::nullopt;
    return second_mV->at(t).value_or(std::numeric_limits<float>::quiet_NaN());
  }
  // From -1 to 1; not a number: its sensor is off. 0 where nothing is connected.
  [[nodiscard]] float respiration_at(Instant t) const noexcept {
    if (!respiration) return 0.0F;
    return respiration->at(t).value_or(std::numeric_limits<float>::quiet_NaN());
  }
};

}  // namespace perimap

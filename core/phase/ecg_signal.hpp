// What an ECG lead is good for at the moment.
#pragma once

#include <cstdint>

namespace perimap {

enum class EcgSignal : std::uint8_t {
  kLearning,  // nothing has stood out from the noise yet, or for some cycles
  kGood,
  kNoisy,    // disturbances of a beat's size within the last seconds, or noise that comes near to beats all the time
  kFlat,     // the value has hardly changed: a lead that is off, or an amplifier at its limit
  kLeadOff,  // said by the device, samples that are missing, or a line that swings as no heart does
  kRepeated  // what was heard seconds before comes again bit for bit
};

// 0 to 4: what is heard better has a higher one.
[[nodiscard]] constexpr int rank(EcgSignal signal) noexcept {
  switch (signal) {
    case EcgSignal::kGood:
      return 4;
    case EcgSignal::kNoisy:
      return 3;
    case EcgSignal::kLearning:
      return 2;
    case EcgSignal::kFlat:
      return 1;
    case EcgSignal::kLeadOff:
    case EcgSignal::kRepeated:
      break;
  }
  return 0;
}

}  // namespace perimap

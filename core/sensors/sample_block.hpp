// What a short run of evenly spaced samples of one signal says besides the samples.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/time/instant.hpp"

namespace perimap {

struct SampleBlock {
  static constexpr std::size_t kCapacity = 64;

  Instant first_sample_time;
  Instant arrival;
  Duration sample_period{0};
  std::uint32_t device_sequence = 0;  // the device's count of the first sample
  std::uint32_t count = 0;

  [[nodiscard]] Instant time_of(std::uint32_t sample) const noexcept {
    return first_sample_time + sample * sample_period;
  }
  // Requires samples.
  [[nodiscard]] Instant last_sample_time() const noexcept { return time_of(count - 1); }
};

}  // namespace perimap

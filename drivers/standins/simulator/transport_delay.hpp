// How long a simulated device's data take to arrive.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/time/instant.hpp"
#include "drivers/standins/random/counter_noise.hpp"

namespace perimap {

// Arrival = source time + least + an exponentially distributed rest, never before an earlier one of the same source.
class TransportDelay {
 public:
  TransportDelay(CounterNoise noise, Duration least, Duration mean_rest) noexcept
      : noise_(noise), least_(least), mean_rest_(mean_rest) {}

  [[nodiscard]] Instant arrival(Instant source_time, std::uint64_t index) noexcept {
    const double rest = std::min(8.0, -std::log(noise_.uniform(index)));
    const Instant arrival = source_time + least_ + from_seconds(rest * to_seconds(mean_rest_));
    latest_ = std::max(arrival, latest_ + Duration(1));
    return latest_;
  }

 private:
  CounterNoise noise_;
  Duration least_;
  Duration mean_rest_;
  Instant latest_{};
};

}  // namespace perimap

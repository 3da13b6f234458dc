// Where the wall clock stands.
#pragma once

#include <ctime>

#include "core/time/instant.hpp"

namespace perimap {

// UTC since 1970 less CLOCK_MONOTONIC, now.
[[nodiscard]] inline Duration utc_minus_monotonic() noexcept {
  std::timespec utc{};
  clock_gettime(CLOCK_REALTIME, &utc);
  return std::chrono::seconds(utc.tv_sec) + std::chrono::nanoseconds(utc.tv_nsec) -
         MonotonicClock::now().time_since_epoch();
}

}  // namespace perimap

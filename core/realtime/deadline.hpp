// Sleeping to an absolute instant.
#pragma once

#include <ctime>

#include "core/time/instant.hpp"

namespace perimap {

// Returns at `deadline` or as soon after it as the kernel runs the thread; at once when it has passed.
// Absolute, so that a preemption between reading the clock and sleeping does not add to the error.
inline void sleep_until(Instant deadline) noexcept {
  const auto ns = to_ns(deadline);
  const std::timespec ts{ns / 1'000'000'000, ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &ts, nullptr) != 0) {
  }
}

}  // namespace perimap

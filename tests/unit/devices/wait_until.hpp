// For tests with threads and emulated devices: something happens, in the end.
#pragma once

#include <functional>
#include <thread>

#include "core/time/instant.hpp"

namespace perimap {

// False when it has not after `longest`.
inline bool wait_until(const std::function<bool()>& met, Duration longest = std::chrono::seconds(20)) {
  const Instant deadline = MonotonicClock::now() + longest;
  while (!met()) {
    if (MonotonicClock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

}  // namespace perimap

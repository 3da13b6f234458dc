// Instants and durations. One named clock, so that an instant of another clock does not compile in its place.
#pragma once

#include <chrono>
#include <cstdint>
#include <ctime>

namespace perimap {

// CLOCK_MONOTONIC, the clock of the kernel's own device stamps (V4L2, SO_TIMESTAMPING after conversion).
// In lockstep replay the same type carries the recording's virtual time.
struct MonotonicClock {
  using duration = std::chrono::nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<MonotonicClock, duration>;
  static constexpr bool is_steady = true;

  [[nodiscard]] static time_point now() noexcept {
    std::timespec ts{};
    clock_gettime(CLOCK_MONOTONIC, &ts);
    return time_point(std::chrono::seconds(ts.tv_sec) + std::chrono::nanoseconds(ts.tv_nsec));
  }
};

using Duration = std::chrono::nanoseconds;
using Instant = MonotonicClock::time_point;

// Nanoseconds since the clock's epoch, as the wire and the recordings carry instants.
[[nodiscard]] constexpr std::int64_t to_ns(Instant t) noexcept { return t.time_since_epoch().count(); }
[[nodiscard]] constexpr Instant from_ns(std::int64_t ns) noexcept { return Instant(Duration(ns)); }

[[nodiscard]] constexpr double to_seconds(Duration d) noexcept { return std::chrono::duration<double>(d).count(); }
// Rounds to the nearest nanosecond; |seconds| must stay below 292 years.
[[nodiscard]] constexpr Duration from_seconds(double seconds) noexcept {
  return Duration(static_cast<std::int64_t>(seconds * 1e9 + (seconds < 0 ? -0.5 : 0.5)));
}

}  // namespace perimap

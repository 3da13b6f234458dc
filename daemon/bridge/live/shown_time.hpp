// How long what a bridge hands on holds, and where it lies in UTC.
#pragma once

#include <algorithm>
#include <chrono>

#include "core/time/instant.hpp"
#include "daemon/subscribing/any_time.hpp"
#include "daemon/subscribing/shown_surface.hpp"

namespace perimap {

// So long without a surface is silence.
inline constexpr Duration kBridgeSilence = std::chrono::milliseconds(500);
// Publishers that are there are found within a second or two.
inline constexpr Duration kNobodyAfter = std::chrono::seconds(2);

// Until when a surface that came now may be shown, or an invalid one is news.
[[nodiscard]] inline Instant shown_until(const ShownSurface& surface, Instant now) noexcept {
  const Instant silent = now + kBridgeSilence;
  return surface.usable() ? std::min(silent, surface.valid_until) : silent;
}

[[nodiscard]] inline Instant utc_now() {
  return Instant(std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch()));
}

// An instant of the publisher's clock, not before 1970 nor after `last`; `now_utc` where the surface does not tell UTC.
[[nodiscard]] inline Instant utc_of(const ShownSurface& surface, Instant on_publishers_clock, Instant now_utc,
                                    Instant last) noexcept {
  if (surface.utc_minus_monotonic == Duration(0)) return std::clamp(now_utc, from_ns(0), last);
  return from_ns(std::clamp<std::int64_t>(wrapped_sum(to_ns(on_publishers_clock), surface.utc_minus_monotonic.count()),
                                          0, to_ns(last)));
}

}  // namespace perimap

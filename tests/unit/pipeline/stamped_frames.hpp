// Frames of a camera for tests of releases.
#pragma once

#include <chrono>
#include <cstdint>

#include "core/sensors/frame_stamp.hpp"
#include "core/time/instant.hpp"

namespace perimap::test {

inline constexpr Duration kLatency = std::chrono::milliseconds(50);

inline Instant at_ms(int ms) { return Instant(std::chrono::milliseconds(10'000 + ms)); }

// Arrives 12 ms after its capture.
inline FrameStamp frame(std::uint64_t sequence, int capture_ms) {
  return {sequence, at_ms(capture_ms), at_ms(capture_ms + 12)};
}

}  // namespace perimap::test

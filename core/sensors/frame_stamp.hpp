// When a camera frame was exposed and when it came.
#pragma once

#include <cstdint>

#include "core/time/instant.hpp"

namespace perimap {

struct FrameStamp {
  std::uint64_t sequence = 0;  // the device's own count; a gap is a dropped frame
  Instant capture;             // mid-exposure
  Instant arrival;
};

}  // namespace perimap

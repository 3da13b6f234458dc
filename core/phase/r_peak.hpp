// One R peak of the ECG.
#pragma once

#include "core/time/instant.hpp"

namespace perimap {

struct RPeak {
  Instant time;             // of the peak itself, finer than the sample period
  Instant detected_at;      // stamp of the sample that made it known; later than `time` by the detector's delay
  double confidence = 0.0;  // 0 to 1: how far it stands out from noise and how much it resembles the beats before
  Duration deviation{0};    // standard deviation of `time`
};

}  // namespace perimap

// A delay that drifts: so much earlier than its stamp says was something taken.
#pragma once

#include <algorithm>
#include <vector>

#include "core/time/instant.hpp"

namespace perimap {

// Evenly from where the last drift left it, to what is said here, and stays. In order, without overlap.
struct Drift {
  Instant begin;
  Instant end;
  Duration to{0};
};

[[nodiscard]] inline Duration drifted(const std::vector<Drift>& drifts, Instant t) noexcept {
  double s = 0.0;
  for (const Drift& drift : drifts) {
    if (t <= drift.begin) break;
    const double share = std::min(1.0, to_seconds(t - drift.begin) / to_seconds(drift.end - drift.begin));
    s += share * (to_seconds(drift.to) - s);
  }
  return from_seconds(s);
}

}  // namespace perimap

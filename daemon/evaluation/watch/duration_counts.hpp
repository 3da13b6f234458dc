// Percentiles of durations over hours, to the microsecond.
#pragma once

#include <cstdint>
#include <map>

#include "core/time/instant.hpp"

namespace perimap {

struct DurationSpread {
  std::uint64_t count = 0;
  Duration p50{0};
  Duration p99{0};
  Duration max{0};
};

// Counts durations by whole microseconds, so that its size depends on how far they scatter and not on how many they
// are.
class DurationCounts {
 public:
  void add(Duration duration);
  // Nearest-rank percentiles.
  [[nodiscard]] DurationSpread spread() const;

 private:
  std::map<std::chrono::microseconds, std::uint64_t> counts_;
  std::uint64_t count_ = 0;
};

}  // namespace perimap

// What a benchmark says of many durations, exactly: every one of them is kept.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/time/instant.hpp"

namespace perimap::bench {

struct Figures {
  std::uint64_t count = 0;
  Duration p50{0};
  Duration p99{0};
  Duration p999{0};
  Duration max{0};
  double on_time = 0.0;  // share of those at most kOnTime
};

// Nearest-rank percentiles; all zero when there are none.
[[nodiscard]] Figures figures_of(std::vector<Duration> durations);

// How many of the sequence numbers sent were never received, in whatever order either came.
[[nodiscard]] std::uint64_t missing_numbers(std::span<const std::uint64_t> sent,
                                            std::span<const std::uint64_t> received);

}  // namespace perimap::bench

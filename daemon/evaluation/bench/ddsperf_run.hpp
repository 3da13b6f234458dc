// Cyclone's own benchmark, as the measure of what DDS takes by itself.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"

namespace perimap::bench {

// One second of `ddsperf ping`: one-way times, which it takes as half of the way there and back.
struct DdsperfSecond {
  double p50_us = 0.0;
  double p99_us = 0.0;
  double max_us = 0.0;
  int count = 0;
};

struct DdsperfResult {
  std::string beside;     // the run that it follows
  std::size_t bytes = 0;  // of a message
  std::string not_run;    // why not; empty when it was
  int count = 0;          // of messages
  double p50_us = 0.0;    // median of the seconds' medians
  double p99_us = 0.0;    // median of the seconds' 99th percentiles
  double max_us = 0.0;
};

// A line of its output; nothing when it tells something else.
[[nodiscard]] std::optional<DdsperfSecond> parse_ddsperf_line(const std::string& line);

// Best effort, as surfaces are, on wait sets, as our subscribers are, without real-time priority; the first second is
// left out.
[[nodiscard]] DdsperfResult run_ddsperf(int domain, std::size_t bytes, double rate_hz, Duration length,
                                        const std::string& beside);

}  // namespace perimap::bench

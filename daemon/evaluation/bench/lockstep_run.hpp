// Runs over the recording in virtual time: what computing costs, and whether memory stays as it is.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/error/expected.hpp"
#include "core/realtime/latency_histogram.hpp"
#include "daemon/evaluation/bench/bench_input.hpp"
#include "daemon/evaluation/bench/figures.hpp"
#include "daemon/process/stop_signal.hpp"

namespace perimap::bench {

// Of the frames after the time to settle, one worker.
struct CostResult {
  int features_asked = 0;
  double features = 0.0;  // mapped, mean
  std::uint64_t frames = 0;
  Figures processor;                  // of all threads together, a frame, finding and starting features included
  LatencyHistogram::Summary compute;  // a frame from A to D, as long as it took
  LatencyHistogram::Summary find;     // A of it
};
[[nodiscard]] SetupExpected<CostResult> run_cost(const BenchInput& input, int features, StopSignal& stop);

struct MemoryReading {
  std::uint64_t frames = 0;
  std::uint64_t resident_kB = 0;
  std::uint64_t features = 0;  // mapped
};
struct MemoryResult {
  int features_asked = 0;
  std::uint64_t frames = 0;
  std::uint64_t rounds = 0;             // through the recording, the last of them perhaps not whole
  std::vector<MemoryReading> readings;  // the first when the first round has ended
};
// The recording again and again, until so many frames are mapped. At the seam all sources are silent for a second,
// which their counts show; all clocks go on, and the map is kept.
[[nodiscard]] SetupExpected<MemoryResult> run_memory(const BenchInput& input, int features, int workers,
                                                     std::uint64_t frames, StopSignal& stop);

// Moves a recording's events on, round after round; between two rounds all sources are silent for kSeam.
class Rounds {
 public:
  // Every event of each round, in order.
  void move(ReplayEvent& event);
  void next_round();

 private:
  // As recorded.
  struct Seen {
    std::optional<Instant> first_arrival;
    Instant last_arrival;
    std::optional<FrameStamp> first_frame;
    FrameStamp last_frame;
    std::optional<EcgBlock> first_ecg;
    EcgBlock last_ecg;
  };
  Seen seen_;
  // Added in this round.
  Duration offset_{0};
  std::uint64_t frames_ = 0;
  std::uint32_t samples_ = 0;
};
inline constexpr Duration kSeam = std::chrono::seconds(1);

}  // namespace perimap::bench

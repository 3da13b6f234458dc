// From ECG samples to the phase clock: what the ECG thread does with each block.
#pragma once

#include <cstdint>

#include "core/phase/beat_classer.hpp"
#include "core/phase/cardiac_clock.hpp"
#include "core/phase/cardiac_clock_tracker.hpp"
#include "core/phase/r_peak_detector.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/realtime/triple_buffer.hpp"
#include "core/sensors/ecg_block.hpp"

namespace perimap {

// The ECG thread is the one writer of the clock. A triple buffer serves one reader, so there is a cell per reader.
struct ClockCells {
  TripleBuffer<CardiacClock> mapper;
  TripleBuffer<CardiacClock> publisher;
  TripleBuffer<CardiacClock> status;
};

class EcgIntake {
 public:
  EcgIntake(const CardiacClockSettings& settings, ClockCells& cells, PipelineCounters& counters) noexcept
      : tracker_(settings), cells_(cells), counters_(counters) {}

  void push(const EcgBlock& block) noexcept;

 private:
  void publish() noexcept;

  RPeakDetector detector_;
  BeatClasser classer_;
  CardiacClockTracker tracker_;
  ClockCells& cells_;
  PipelineCounters& counters_;
  bool started_ = false;
  std::uint32_t next_device_sequence_ = 0;
};

}  // namespace perimap

// One live run over the recording: the whole runtime, DDS, and subscribers in processes of their own.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/pipeline/frame_trace.hpp"
#include "core/pipeline/release_stream.hpp"
#include "core/realtime/latency_histogram.hpp"
#include "daemon/evaluation/bench/bench_input.hpp"
#include "daemon/evaluation/bench/figures.hpp"
#include "daemon/process/stop_signal.hpp"

namespace perimap::bench {

struct LiveCase {
  std::string part;
  std::string name;
  int features = 200;
  int workers = 2;
  int priority = 0;  // SCHED_FIFO of the publisher; 0: none
  std::vector<int> cpus;
  int every_frame = 1;  // every n-th frame of the recording is played
  double speed = 1.0;   // all its clocks run so much faster
  // The releases that are measured; the frames' are published beside the clock's.
  ReleaseStream stream = ReleaseStream::kFrame;
  double clock_rate_hz = 0.0;  // 0: without the clock's
  int subscribers = 1;
  bool slow_subscriber = false;  // one more, which does something else for 200 ms after each take
  bool recording = false;        // while it publishes
  bool secured = false;          // publisher and subscribers have keys
  bool stress = false;           // beside stress-ng on all processors, memory and disk
  int pages = 0;                 // of perimap view, open in browsers beside it
};

struct StageFigures {
  std::string name;
  LatencyHistogram::Summary summary;
};

// Of the time that counts, but for the counts, which are of the whole run.
struct LiveFigures {
  std::optional<Instant> counted_from;  // the first release that counts
  Figures tardiness;                    // deadline to just before the write
  Figures bare;                         // deadline to wake-up of the loop beside it
  Figures dds_write;                    // by itself
  Figures capture_to_release;           // capture to just before the write
  Figures capture_to_receipt;           // at the first subscriber
  Figures write_to_receipt;             // from just before the write, likewise
  std::vector<StageFigures> stages;
  std::uint64_t sent = 0;
  std::uint64_t missing = 0;          // at the worst of the subscribers that are not slow
  std::uint64_t missing_at_slow = 0;  // at the one that is
  double features = 0.0;              // of a surface, mean
  std::size_t surface_bytes = 0;      // of one with that many
  double rate_hz = 0.0;               // of the releases
  std::uint64_t frames_dropped = 0;
  std::uint64_t frames_too_late = 0;
  std::uint64_t without_frame = 0;
  std::uint64_t from_late_update = 0;
  std::uint64_t releases_missed = 0;
  std::uint64_t releases_late = 0;
  std::uint64_t learning_put_off = 0;
  std::uint64_t frames_not_recorded = 0;
  int pages_open = 0;  // when the last surface had been released
  bool priority_granted = false;
  double load_before = 0.0;  // of the machine, 1 min
};

struct LiveResult {
  LiveCase live_case;
  std::string not_run;  // why not; empty when it was
  LiveFigures figures;
};

// `stop` ends the run early; what was measured until then counts. `trace`, which may be null, gets each frame's life.
[[nodiscard]] SetupExpected<LiveResult> run_live(const BenchInput& input, const LiveCase& live_case, StopSignal& stop,
                                                 FrameTrace* trace);

}  // namespace perimap::bench

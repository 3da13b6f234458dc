// The replay-driven latency benchmark: which runs it makes, and in what order.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/evaluation/bench/ddsperf_run.hpp"
#include "daemon/evaluation/bench/live_run.hpp"
#include "daemon/evaluation/bench/lockstep_run.hpp"
#include "daemon/evaluation/bench/machine.hpp"
#include "daemon/evaluation/bench/trace_file.hpp"

namespace perimap::bench {

// The parts, in the order in which they are run.
inline const std::vector<std::string> kParts = {"live", "ddsperf", "subscribers", "recording", "load", "workers",
                                                "rate", "clock",   "features",    "pages",     "cost", "memory"};
// Run when it is asked for: it needs Cyclone's security plugins.
inline constexpr const char* kSecurityPart = "security";

// Of `only`, where any are named; else all, or with security that part alone. What another part is held beside comes
// with it.
[[nodiscard]] std::set<std::string> chosen_parts(const std::vector<std::string>& only, bool security);

struct BenchSettings {
  BenchInput input;
  std::set<std::string> parts;  // of kParts, and kSecurityPart
  int runs = 3;                 // of the parts `live`, `pages` and `security`
  std::uint64_t frames = 6000;  // of the part `memory`
  int features = 200;
  int workers = 2;
  int priority = 80;  // of the runs with SCHED_FIFO
  std::vector<int> cpus;
};

struct BenchReport {
  BenchSettings settings;
  Machine machine;
  std::string begun_utc;
  std::vector<LiveResult> live;
  std::vector<DdsperfResult> ddsperf;
  std::vector<CostResult> cost;
  std::optional<MemoryResult> memory;
  bool stopped = false;  // before its end
};

// `on_run(number, all, name)` is called before each run, the first of which is number 1. `trace`, which may be null,
// gets the live runs.
[[nodiscard]] SetupExpected<BenchReport> run_bench(const BenchSettings& settings, StopSignal& stop,
                                                   const std::function<void(int, int, const std::string&)>& on_run,
                                                   TraceFile* trace);

// The runs that the settings ask for. `may_be_realtime`: without it those with SCHED_FIFO are left out.
[[nodiscard]] std::vector<LiveCase> live_cases(const BenchSettings& settings, bool may_be_realtime);

}  // namespace perimap::bench

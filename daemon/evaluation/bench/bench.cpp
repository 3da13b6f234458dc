#include "daemon/evaluation/bench/bench.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace perimap::bench {
namespace {

constexpr Duration kLongestDdsperf = std::chrono::seconds(10);
const std::vector<int> kCosts = {50, 100, 200, 500, 1000, 2000, 5000};

}  // namespace

std::set<std::string> chosen_parts(const std::vector<std::string>& only, bool security) {
  std::set<std::string> parts(only.begin(), only.end());
  if (security) parts.insert(kSecurityPart);
  if (parts.empty()) parts.insert(kParts.begin(), kParts.end());
  if (parts.contains("ddsperf")) parts.insert("live");
  return parts;
}

std::vector<LiveCase> live_cases(const BenchSettings& settings, bool may_be_realtime) {
  std::vector<LiveCase> cases;
  const auto add = [&](const std::string& part, const std::string& name, int priority, const auto& change) {
    if (!settings.parts.contains(part) || (priority > 0 && !may_be_realtime)) return;
    LiveCase one;
    one.part = part;
    one.name = priority > 0 ? name + ", FIFO" : name;
    one.features = settings.features;
    one.workers = settings.workers;
    one.priority = priority;
    if (priority > 0) one.cpus = settings.cpus;
    change(one);
    cases.push_back(one);
  };
  const auto nothing = [](LiveCase&) {};
  // Both kinds in turn, so that what disturbs the machine disturbs both.
  for (int run = 1; run <= settings.runs; ++run) {
    for (const int priority : {0, settings.priority}) add("live", fmt::format("run {}", run), priority, nothing);
  }
  const int best = may_be_realtime ? settings.priority : 0;
  // In turn as well: what security costs is the difference within one run of the benchmark.
  for (int run = 1; run <= settings.runs; ++run) {
    add(kSecurityPart, fmt::format("without keys, run {}", run), best, nothing);
    add(kSecurityPart, fmt::format("with keys, run {}", run), best, [](LiveCase& one) { one.secured = true; });
  }
  for (const int subscribers : {5, 20}) {
    add("subscribers", fmt::format("{} subscribers", subscribers), best,
        [&](LiveCase& one) { one.subscribers = subscribers; });
  }
  add("subscribers", "one more, slow", best, [](LiveCase& one) { one.slow_subscriber = true; });
  add("recording", "recording", best, [](LiveCase& one) { one.recording = true; });
  for (const int priority : {0, settings.priority}) {
    add("load", "under load", priority, [](LiveCase& one) { one.stress = true; });
  }
  for (const int workers : {1, 2, 4}) {
    add("workers", fmt::format("{} workers", workers), best, [&](LiveCase& one) { one.workers = workers; });
  }
  for (const auto& [every, name] :
       {std::pair{4, "a quarter of the frames"}, std::pair{2, "half of the frames"}, std::pair{1, "all frames"}}) {
    add("rate", name, best, [every = every](LiveCase& one) { one.every_frame = every; });
  }
  add("rate", "twice as fast", best, [](LiveCase& one) { one.speed = 2.0; });
  // The clock's releases beside the frames', and what these are then.
  for (const double rate_hz : {100.0, 250.0, 1000.0}) {
    for (const ReleaseStream stream : {ReleaseStream::kClock, ReleaseStream::kFrame}) {
      add("clock", fmt::format("clock at {:.0f}/s: stream {}", rate_hz, name_of(stream)), best, [&](LiveCase& one) {
        one.stream = stream;
        one.clock_rate_hz = rate_hz;
      });
    }
  }
  for (const int features : {50, 100, 200, 400, 1000}) {
    add("features", fmt::format("{} features", features), best, [&](LiveCase& one) { one.features = features; });
  }
  return cases;
}

SetupExpected<BenchReport> run_bench(const BenchSettings& settings, StopSignal& stop,
                                     const std::function<void(int, int, const std::string&)>& on_run) {
  BenchReport report;
  report.settings = settings;
  report.machine = this_machine();
  report.begun_utc = fmt::format("{:%Y-%m-%d %H:%M:%S}", fmt::gmtime(std::chrono::system_clock::now()));
  const bool beside_ddsperf = settings.parts.contains("ddsperf");
  const std::vector<LiveCase> cases = live_cases(settings, report.machine.realtime_permitted);
  const std::vector<int> costs = settings.parts.contains("cost") ? kCosts : std::vector<int>();
  const bool memory = settings.parts.contains("memory");
  const int all = static_cast<int>(cases.size() + costs.size()) + (memory ? 1 : 0);
  int number = 0;
  for (const LiveCase& one : cases) {
    on_run(++number, all, one.part + ": " + one.name);
    auto result = run_live(settings.input, one, stop);
    if (!result) return tl::unexpected(result.error());
    report.live.push_back(std::move(*result));
    const LiveFigures& figures = report.live.back().figures;
    // In turn with the runs that it is the measure of, at their size and rate.
    if (beside_ddsperf && one.part == "live" && figures.sent > 0 && !stop.requested()) {
      report.ddsperf.push_back(run_ddsperf(settings.input.domain, figures.surface_bytes, figures.rate_hz,
                                           std::min(settings.input.measure, kLongestDdsperf), one.name));
    }
    report.stopped = stop.requested();
    if (report.stopped) return report;
  }
  for (const int features : costs) {
    on_run(++number, all, fmt::format("cost: {} features, in lockstep", features));
    auto result = run_cost(settings.input, features, stop);
    if (!result) return tl::unexpected(result.error());
    report.cost.push_back(*result);
    report.stopped = stop.requested();
    if (report.stopped) return report;
  }
  if (memory) {
    on_run(++number, all, fmt::format("memory: {} frames, in lockstep", settings.frames));
    auto result = run_memory(settings.input, settings.features, settings.workers, settings.frames, stop);
    if (!result) return tl::unexpected(result.error());
    report.memory = std::move(*result);
    report.stopped = stop.requested();
  }
  return report;
}

}  // namespace perimap::bench

#include "daemon/evaluation/bench/bench.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace perimap::bench {
namespace {

constexpr Duration kLongestDdsperf = std::chrono::seconds(10);
// What is played before and after what is asked for, and the fastest camera that the pipeline keeps pace with.
constexpr double kTracedBeside_s = 5.0;
constexpr double kFastest_per_s = 280.0;
constexpr double kMostTracedFrames = 100'000.0;
constexpr int kPages = 4;
const std::vector<int> kCosts = {50, 100, 200, 500, 1000, 2000, 5000};

std::size_t traced_frames(const BenchInput& input) {
  const double seconds = to_seconds(input.settle) + to_seconds(input.measure) + kTracedBeside_s;
  return static_cast<std::size_t>(std::min(kFastest_per_s * seconds, kMostTracedFrames));
}

SetupExpected<LiveResult> run_traced(const BenchInput& input, const LiveCase& live_case, StopSignal& stop,
                                     TraceFile& file) {
  FrameTrace trace(traced_frames(input), live_case.workers);
  auto result = run_live(input, live_case, stop, &trace);
  if (!result) return result;
  if (auto added = file.add(live_case.part + ": " + live_case.name, trace, result->figures.counted_from); !added)
    return tl::unexpected(SetupError{added.error()});
  return result;
}

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
  // In turn, as with keys: what looking costs is the difference.
  for (int run = 1; run <= settings.runs; ++run) {
    add("pages", fmt::format("nobody looks, run {}", run), best, nothing);
    add("pages", fmt::format("{} pages, run {}", kPages, run), best, [](LiveCase& one) { one.pages = kPages; });
  }
  for (const int features : {50, 100, 200, 400, 1000}) {
    add("features", fmt::format("{} features", features), best, [&](LiveCase& one) { one.features = features; });
  }
  return cases;
}

SetupExpected<BenchReport> run_bench(const BenchSettings& settings, StopSignal& stop,
                                     const std::function<void(int, int, const std::string&)>& on_run,
                                     TraceFile* trace) {
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
    auto result =
        trace != nullptr ? run_traced(settings.input, one, stop, *trace) : run_live(settings.input, one, stop, nullptr);
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

#include "daemon/evaluation/bench/lockstep_run.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <utility>
#include <variant>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "drivers/recording/replay_reader.hpp"

namespace perimap::bench {
namespace {

constexpr std::uint64_t kReadings = 50;

class NoPublication final : public Publication {
 public:
  void surface(const perimap_Surface& /*sample*/) override {}
  void surface_model(const perimap_SurfaceModel& /*model*/) override {}
  void phase(const perimap_Phase& /*phase*/) override {}
  void status(const perimap_Status& /*status*/) override {}
};

struct LockstepSession {
  explicit LockstepSession(const ReplaySetup& setup)
      : pipeline(in_lockstep(setup.pipeline)), runtime(pipeline, setup.identity, setup.utc_minus_monotonic, nowhere) {}

  static PipelineSettings in_lockstep(PipelineSettings settings) {
    settings.lockstep = true;
    return settings;
  }

  Pipeline pipeline;
  NoPublication nowhere;
  LockstepRuntime runtime;
};

// That all threads have had of the processors.
Duration processor_time() {
  std::timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
}

std::uint64_t resident_kB() {
  std::uint64_t size = 0;
  std::uint64_t resident = 0;
  std::ifstream("/proc/self/statm") >> size >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)) / 1024;
}

std::uint64_t mapped(const PipelineCounters& c) {
  return c.features_converging.get() + c.features_converged.get() + c.features_inconsistent.get();
}

}  // namespace

SetupExpected<CostResult> run_cost(const BenchInput& input, int features, StopSignal& stop) {
  auto setup = prepare_run(input, features, 1);
  if (!setup) return tl::unexpected(setup.error());
  LockstepSession session(*setup);
  LockstepRuntime& runtime = session.runtime;
  const PipelineCounters& counters = session.pipeline.counters();

  CostResult result;
  result.features_asked = features;
  const ReplayEdit edit = paced(1, 1.0, input.settle + input.measure);
  std::optional<Instant> first;
  std::optional<std::pair<LatencyHistogram::Counts, LatencyHistogram::Counts>> before;
  std::vector<Duration> processor;
  Duration since_last_frame{0};
  while (!stop.requested()) {
    auto event = setup->reader.next();
    if (!event) return tl::unexpected(event.error());
    if (!*event || edit(**event) == ReplayStep::kEnd) break;
    const Instant arrival = arrival_of(**event);
    if (!first) first = arrival;
    if (!before && arrival - *first >= input.settle)
      before.emplace(counters.frame_compute.counts(), counters.predict_and_find.counts());
    const std::uint64_t frames = counters.frames.get();
    const Duration used = processor_time();
    runtime.deliver(**event);
    if (!before) continue;
    since_last_frame += processor_time() - used;
    if (counters.frames.get() == frames) continue;
    processor.push_back(std::exchange(since_last_frame, Duration(0)));
    ++result.frames;
    result.features += static_cast<double>(mapped(counters));
  }
  runtime.finish();
  if (result.frames == 0) return result;
  result.features /= static_cast<double>(result.frames);
  result.processor = figures_of(std::move(processor));
  result.compute = LatencyHistogram::between(before->first, counters.frame_compute.counts());
  result.find = LatencyHistogram::between(before->second, counters.predict_and_find.counts());
  return result;
}

void Rounds::move(ReplayEvent& event) {
  if (!seen_.first_arrival) seen_.first_arrival = arrival_of(event);
  seen_.last_arrival = arrival_of(event);
  if (auto* frame = std::get_if<FrameEvent>(&event)) {
    if (!seen_.first_frame) seen_.first_frame = frame->stamp;
    seen_.last_frame = frame->stamp;
    frame->stamp.sequence += frames_;
  } else if (auto* ecg = std::get_if<EcgBlock>(&event)) {
    if (!seen_.first_ecg) seen_.first_ecg = *ecg;
    seen_.last_ecg = *ecg;
    ecg->device_sequence += samples_;
  }
  shift(event, offset_);
}

void Rounds::next_round() {
  const Seen seen = std::exchange(seen_, {});
  if (!seen.first_arrival) return;
  const Duration round = seen.last_arrival - *seen.first_arrival + kSeam;
  offset_ += round;
  // As many are counted as there is time for, those that the silence hides included.
  if (seen.first_frame && seen.last_frame.sequence > seen.first_frame->sequence) {
    const std::uint64_t steps = seen.last_frame.sequence - seen.first_frame->sequence;
    const double a_step = to_seconds(seen.last_frame.capture - seen.first_frame->capture) / static_cast<double>(steps);
    frames_ += std::max<std::uint64_t>(steps + 1, static_cast<std::uint64_t>(std::llround(to_seconds(round) / a_step)));
  }
  if (seen.first_ecg && seen.last_ecg.sample_period > Duration(0)) {
    const std::uint32_t heard = seen.last_ecg.device_sequence - seen.first_ecg->device_sequence + seen.last_ecg.count;
    samples_ += std::max(heard, static_cast<std::uint32_t>(round / seen.last_ecg.sample_period));
  }
}

SetupExpected<MemoryResult> run_memory(const BenchInput& input, int features, int workers, std::uint64_t frames,
                                       StopSignal& stop) {
  auto setup = prepare_run(input, features, workers);
  if (!setup) return tl::unexpected(setup.error());
  LockstepSession session(*setup);
  LockstepRuntime& runtime = session.runtime;
  const PipelineCounters& counters = session.pipeline.counters();

  MemoryResult result;
  result.features_asked = features;
  Rounds rounds;
  std::optional<ReplayReader> reader(std::move(setup->reader));
  const auto read = [&] { result.readings.push_back({counters.frames.get(), resident_kB(), mapped(counters)}); };
  for (;;) {
    const std::uint64_t before = counters.frames.get();
    while (!stop.requested() && counters.frames.get() < frames) {
      auto event = reader->next();
      if (!event) return tl::unexpected(event.error());
      if (!*event) break;
      rounds.move(**event);
      runtime.deliver(**event);
      if (!result.readings.empty() && counters.frames.get() >= result.readings.back().frames + frames / kReadings)
        read();
    }
    ++result.rounds;
    if (stop.requested() || counters.frames.get() >= frames || counters.frames.get() == before) break;
    if (result.readings.empty()) read();
    rounds.next_round();
    auto again = prepare_run(input, features, workers);
    if (!again) return tl::unexpected(again.error());
    reader.reset();
    reader.emplace(std::move(again->reader));
  }
  runtime.finish();
  read();
  result.frames = counters.frames.get();
  return result;
}

}  // namespace perimap::bench

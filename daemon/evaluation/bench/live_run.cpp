#include "daemon/evaluation/bench/live_run.hpp"

#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/sensor_entrance.hpp"
#include "daemon/evaluation/bench/bare_loop.hpp"
#include "daemon/evaluation/bench/child_process.hpp"
#include "daemon/evaluation/bench/machine.hpp"
#include "daemon/evaluation/bench/open_pages.hpp"
#include "daemon/evaluation/bench/release_log.hpp"
#include "daemon/evaluation/bench/subscriber.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/publishing/dds_publication.hpp"
#include "daemon/runtime/live_session.hpp"
#include "daemon/runtime/replay_feeder.hpp"
#include "daemon/runtime/sensor_feeder.hpp"
#include "daemon/runtime/sensor_intake.hpp"
#include "daemon/runtime/session_recorder.hpp"
#include "daemon/runtime/session_recording.hpp"
#include "drivers/recording/replay_reader.hpp"

namespace perimap::bench {
namespace {

constexpr Duration kSlowPause = std::chrono::milliseconds(200);
constexpr std::size_t kRecordingMemory = std::size_t{256} << 20U;
constexpr std::size_t kMostReleases = 1'000'000;

struct Stage {
  const char* name;
  LatencyHistogram PipelineCounters::*histogram;
};
constexpr std::array<Stage, 7> kStages = {{{"capture to arrival", &PipelineCounters::camera_delay},
                                           {"predict and find", &PipelineCounters::predict_and_find},
                                           {"phase and pose", &PipelineCounters::phase_and_pose},
                                           {"evaluate", &PipelineCounters::evaluate},
                                           {"learn", &PipelineCounters::learn},
                                           {"all four of a frame", &PipelineCounters::frame_compute},
                                           {"capture to update", &PipelineCounters::capture_to_update}}};
using StageCounts = std::array<LatencyHistogram::Counts, kStages.size()>;

StageCounts counts_of(const PipelineCounters& counters) {
  StageCounts counts{};
  for (std::size_t i = 0; i < kStages.size(); ++i) counts[i] = (counters.*kStages[i].histogram).counts();
  return counts;
}

// Played and, if asked, recorded at the same time, as a session over devices is.
class RecordedReplay final : public SensorFeeder {
 public:
  RecordedReplay(ReplayReader reader, SensorEntrance& entrance, SessionRecorder* recorder, ReplayEdit edit)
      : recorder_(recorder),
        replay_(std::move(reader), SensorIntake{&entrance, recorder}, std::nullopt, std::move(edit)) {}

  void start(ThreadLauncher& threads) override {
    if (recorder_ != nullptr) recorder_->start(threads);
    replay_.start(threads);
  }
  void stop() override {
    replay_.stop();
    if (recorder_ != nullptr) recorder_->stop();
  }
  [[nodiscard]] bool ended() const noexcept override { return replay_.ended(); }
  [[nodiscard]] const std::optional<Error>& error() const noexcept override { return replay_.error(); }
  [[nodiscard]] std::vector<Error> damage() const override { return replay_.damage(); }

 private:
  SessionRecorder* recorder_;
  ReplayFeeder replay_;
};

Expected<std::unique_ptr<SessionRecorder>> begin_recording(const std::filesystem::path& file,
                                                           const ReplaySetup& setup) {
  std::error_code error;
  std::filesystem::remove(file, error);
  return SessionRecorder::create(
      file, recording_facts(setup.configuration, setup.pipeline.camera, "perimap bench " PERIMAP_VERSION),
      kRecordingMemory);
}

Expected<ChildProcess> begin_stress(const std::filesystem::path& scratch) {
  const auto program = find_program("stress-ng");
  if (!program) return fail("stress-ng is not installed");
  return ChildProcess::start(*program, {"--cpu", "0", "--vm", "1", "--vm-bytes", "256M", "--hdd", "1", "--hdd-bytes",
                                        "128M", "--temp-path", scratch.string(), "--quiet"});
}

// What else the machine does meanwhile.
struct Beside {
  std::optional<ChildProcess> stress;
  std::optional<OpenPages> pages;
};

Expected<Beside> begin_beside(const BenchInput& input, const LiveCase& live_case) {
  Beside beside;
  if (live_case.stress) {
    auto stress = begin_stress(input.scratch);
    if (!stress) return tl::unexpected(stress.error());
    beside.stress.emplace(std::move(*stress));
  }
  if (live_case.pages > 0) {
    auto pages = OpenPages::open(input.domain, live_case.pages, input.scratch);
    if (!pages) return tl::unexpected(pages.error());
    beside.pages.emplace(std::move(*pages));
  }
  return beside;
}

// The subscribers in the order of their start, the slow one last.
Expected<std::vector<Subscriber>> begin_subscribers(const BenchInput& input, const LiveCase& live_case) {
  std::vector<Subscriber> subscribers;
  const dds::Membership membership{input.domain, live_case.secured ? input.subscriber_keys : std::nullopt};
  for (int i = 0; i < live_case.subscribers + (live_case.slow_subscriber ? 1 : 0); ++i) {
    auto subscriber =
        Subscriber::start(membership, live_case.stream, i < live_case.subscribers ? Duration(0) : kSlowPause);
    if (!subscriber) return tl::unexpected(subscriber.error());
    subscribers.push_back(std::move(*subscriber));
  }
  return subscribers;
}

std::vector<LoggedRelease> those_that_count(std::span<const LoggedRelease> all, Duration settle) {
  if (all.empty()) return {};
  const Instant first = all.front().deadline;
  // A recording that is too short to settle and to measure: its second half.
  const Duration begin = std::min(settle, (all.back().deadline - first) / 2);
  std::vector<LoggedRelease> counting;
  std::copy_if(all.begin(), all.end(), std::back_inserter(counting),
               [&](const LoggedRelease& release) { return release.deadline - first >= begin; });
  return counting;
}

template <class Of>
Figures over(const std::vector<LoggedRelease>& releases, Of of) {
  std::vector<Duration> durations;
  durations.reserve(releases.size());
  for (const LoggedRelease& release : releases) durations.push_back(of(release));
  return figures_of(std::move(durations));
}

void add_releases(const std::vector<LoggedRelease>& releases, LiveFigures& figures) {
  if (!releases.empty()) figures.counted_from = releases.front().deadline;
  figures.tardiness = over(releases, [](const auto& r) { return r.ready - r.deadline; });
  figures.dds_write = over(releases, [](const auto& r) { return r.written - r.ready; });
  figures.capture_to_release = over(releases, [](const auto& r) { return r.ready - r.capture; });
  figures.sent = releases.size();
  for (const LoggedRelease& release : releases) figures.features += release.features;
  figures.features /= static_cast<double>(std::max<std::size_t>(releases.size(), 1));
  if (releases.size() > 1) {
    figures.rate_hz =
        static_cast<double>(releases.size() - 1) / to_seconds(releases.back().deadline - releases.front().deadline);
  }
}

void add_bare_waits(std::span<const BareWait> waits, const std::vector<LoggedRelease>& releases, LiveFigures& figures) {
  std::vector<Duration> durations;
  for (const BareWait& wait : waits) {
    if (!releases.empty() && wait.deadline >= releases.front().deadline && wait.deadline <= releases.back().deadline) {
      durations.push_back(wait.tardiness);
    }
  }
  figures.bare = figures_of(std::move(durations));
}

Expected<void> add_receipts(std::vector<Subscriber>& subscribers, bool last_is_slow,
                            const std::vector<LoggedRelease>& releases, LiveFigures& figures) {
  std::vector<std::uint64_t> sent;
  sent.reserve(releases.size());
  for (const LoggedRelease& release : releases) sent.push_back(release.sequence);
  for (std::size_t i = 0; i < subscribers.size(); ++i) {
    const auto receipts = subscribers[i].finish();
    if (!receipts) return tl::unexpected(receipts.error());
    std::map<std::uint64_t, Instant> times;
    std::vector<std::uint64_t> received;
    for (const Receipt& receipt : *receipts) {
      times[receipt.sequence] = receipt.time;
      received.push_back(receipt.sequence);
    }
    const std::uint64_t missing = missing_numbers(sent, received);
    if (last_is_slow && i + 1 == subscribers.size()) {
      figures.missing_at_slow = missing;
    } else {
      figures.missing = std::max(figures.missing, missing);
    }
    if (i > 0) continue;
    std::vector<Duration> from_capture;
    std::vector<Duration> from_write;
    for (const LoggedRelease& release : releases) {
      const auto time = times.find(release.sequence);
      if (time == times.end()) continue;
      from_capture.push_back(time->second - release.capture);
      from_write.push_back(time->second - release.ready);
    }
    figures.capture_to_receipt = figures_of(std::move(from_capture));
    figures.write_to_receipt = figures_of(std::move(from_write));
  }
  return {};
}

}  // namespace

SetupExpected<LiveResult> run_live(const BenchInput& input, const LiveCase& live_case, StopSignal& stop,
                                   FrameTrace* trace) {
  LiveResult result{live_case, {}, {}};
  LiveFigures& figures = result.figures;
  figures.load_before = load_1_min();
  auto setup = prepare_run(input, live_case.features, live_case.workers);
  if (!setup) return tl::unexpected(setup.error());
  setup->configuration.dds.domain = input.domain;
  setup->pipeline.frame_stream = true;
  setup->pipeline.clock_period =
      live_case.clock_rate_hz > 0.0 ? from_seconds(1.0 / live_case.clock_rate_hz) : Duration(0);

  auto beside = begin_beside(input, live_case);
  if (!beside) {
    result.not_run = beside.error().message;
    return result;
  }
  std::unique_ptr<SessionRecorder> recorder;
  const std::filesystem::path recorded = input.scratch / "perimap-bench.mcap";
  if (live_case.recording) {
    auto created = begin_recording(recorded, *setup);
    if (!created) return tl::unexpected(created.error());
    recorder = std::move(*created);
  }
  auto subscribers = begin_subscribers(input, live_case);
  if (!subscribers) return tl::unexpected(subscribers.error());
  const DdsConfiguration& dds = setup->configuration.dds;
  auto publication = DdsPublication::create({{dds.domain, live_case.secured ? input.publisher_keys : std::nullopt},
                                             dds.surface_deadline,
                                             dds.surface_lifespan});
  if (!publication) return tl::unexpected(publication.error());

  Pipeline pipeline(setup->pipeline, trace);
  RuntimeSettings runtime = runtime_settings(setup->configuration, setup->identity);
  runtime.scheduling = {live_case.priority, live_case.cpus};
  ReleaseLog log(**publication, live_case.stream, kMostReleases);
  StageCounts before{};
  bool settled = false;
  Expected<void> ended;
  {
    ThreadLauncher threads(runtime.scheduling);
    BareLoop bare(threads, log, kMostReleases);
    const PipelineCounters& counters = pipeline.counters();
    std::optional<Instant> first;
    const auto tick = [&] {
      if (settled || counters.of(live_case.stream).samples.get() == 0) return;
      const Instant now = MonotonicClock::now();
      if (!first) first = now;
      if (now - *first < input.settle) return;
      before = counts_of(counters);
      settled = true;
    };
    LiveSession session(pipeline, runtime, log,
                        std::make_unique<RecordedReplay>(std::move(setup->reader), pipeline.entrance(), recorder.get(),
                                                         paced(live_case.every_frame, live_case.speed,
                                                               setup->pipeline.latency + input.settle + input.measure)),
                        tick);
    ended = session.run(stop);
    bare.stop();
    if (beside->pages) figures.pages_open = beside->pages->connected();
    munlockall();  // the session locked what it could; the next run begins as this one did
    figures.priority_granted = threads.priority() == perimap_PRIVILEGE_GRANTED;
    const std::vector<LoggedRelease> releases = those_that_count(log.releases(), input.settle);
    add_releases(releases, figures);
    add_bare_waits(bare.waits(), releases, figures);
    const auto received = add_receipts(*subscribers, live_case.slow_subscriber, releases, figures);
    if (!received) return tl::unexpected(received.error());
  }
  if (!ended) return tl::unexpected(ended.error());

  const PipelineCounters& counters = pipeline.counters();
  const StageCounts after = counts_of(counters);
  for (std::size_t i = 0; i < kStages.size(); ++i) {
    figures.stages.push_back({kStages[i].name, LatencyHistogram::between(before[i], after[i])});
  }
  figures.frames_dropped = counters.frames_dropped.get();
  figures.frames_too_late = counters.frames_too_late.get();
  const StreamCounters& stream = counters.of(live_case.stream);
  figures.without_frame = stream.samples_without_frame.get();
  figures.from_late_update = stream.samples_from_late_update.get();
  figures.releases_missed = stream.releases_missed.get();
  figures.releases_late = stream.releases_late.get();
  figures.learning_put_off = counters.learning_put_off.get();
  if (recorder) {
    const SessionRecorder::Summary summary = recorder->summary();
    figures.frames_not_recorded = summary.frames_not_recorded;
    if (summary.stopped) result.not_run = "recording stopped: " + recorder->reason();
    std::error_code error;
    std::filesystem::remove(recorded, error);
  }
  if (figures.pages_open < live_case.pages)
    result.not_run = fmt::format("{} of {} pages were open", figures.pages_open, live_case.pages);
  const auto bytes = surface_bytes(static_cast<std::size_t>(std::lround(figures.features)));
  if (!bytes) return tl::unexpected(bytes.error());
  figures.surface_bytes = *bytes;
  return result;
}

}  // namespace perimap::bench

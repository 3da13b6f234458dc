#include "daemon/evaluation/replay/replay_run.hpp"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/setup_watcher.hpp"
#include "daemon/evaluation/replay/replay_publication.hpp"
#include "daemon/evaluation/report/recorded_beats.hpp"
#include "daemon/evaluation/report/recorded_truth.hpp"
#include "daemon/evaluation/surface/surface_watch.hpp"
#include "daemon/logging/logging.hpp"
#include "daemon/publishing/dds_publication.hpp"
#include "daemon/publishing/publication_recorder.hpp"
#include "daemon/publishing/status_text.hpp"
#include "daemon/publishing/wire_states.hpp"
#include "daemon/publishing/wire_status.hpp"
#include "daemon/runtime/live_session.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "drivers/standins/session/unrecorded_session.hpp"

namespace perimap {
namespace {

tl::unexpected<SetupError> failed(Error error) { return tl::unexpected(SetupError{std::move(error), false}); }

std::vector<ReplayReport::Stage> stages(const PipelineCounters& c, const PipelineSettings& settings) {
  std::vector<ReplayReport::Stage> all = {{"predict and find", c.predict_and_find.summary()},
                                          {"phase and pose", c.phase_and_pose.summary()},
                                          {"evaluate", c.evaluate.summary()},
                                          {"learn", c.learn.summary()}};
  // Deadlines are virtual in lockstep: nothing is early or late.
  if (settings.lockstep) return all;
  all.push_back({"capture to update", c.capture_to_update.summary()});
  if (settings.frame_stream) {
    all.push_back({"release tardiness", c.of(ReleaseStream::kFrame).release_tardiness.summary()});
  }
  if (publishes(settings, ReleaseStream::kClock)) {
    all.push_back({"clock tardiness", c.of(ReleaseStream::kClock).release_tardiness.summary()});
  }
  return all;
}

// What the status of `stream` counts.
perimap_Status counted(const Identity& identity, ReleaseStream stream, const PipelineCounters& counters,
                       const StatusFacts& facts = {}) {
  perimap_Status status = WireStatus(identity.of(stream)).fill(counters, facts, Instant{});
  status.sources = {};
  status.stages = {};
  return status;
}

// Those, and what the status tells with each source.
nlohmann::json counts(const perimap_Status& status, const PipelineCounters& c) {
  nlohmann::json json = counts_json(status);
  json["frames_dropped"] = c.frames_dropped.get();
  json["respiration_samples"] = c.respiration_samples.get();
  json["respiration_dropped"] = c.respiration_dropped.get();
  json["respiration_off"] = c.respiration_off.get();
  return json;
}

// As a recording's reader has it.
Expected<void> check_size(const UnrecordedSession& session, const CameraModel& camera) {
  if (session.width() == camera.width && session.height() == camera.height) return {};
  return fail(fmt::format("the simulated session: frames of {}x{}, the calibration is for {}x{}", session.width(),
                          session.height(), camera.width, camera.height));
}

// The next event in order of arrival; nullopt at the end.
using NextEvent = std::function<Expected<std::optional<ReplayEvent>>()>;
using FrameProgress = std::function<void(std::uint64_t frames)>;

// In virtual time. Whether a signal stopped it; what of the recording was not whole goes to `damage`.
// `surface`: none without a truth.
Expected<bool> run_lockstep(Pipeline& pipeline, const ReplaySetup& setup, const NextEvent& next,
                            Publication& publication, StopSignal& stop, const FrameProgress& progress,
                            std::vector<Error>& damage, std::optional<SurfaceWatch>& surface) {
  LockstepRuntime runtime(pipeline, setup.identity, setup.utc_minus_monotonic, publication, setup.tools);
  std::uint64_t shown = 0;
  for (;;) {
    auto event = next();
    if (!event) return tl::unexpected(event.error());
    if (!*event) break;
    runtime.deliver(**event);
    const std::uint64_t frames = pipeline.counters().frames.get();
    if (frames == shown) continue;
    shown = frames;
    if (surface) surface->after_frame();
    progress(frames);
    if (stop.requested()) return true;
  }
  runtime.finish();
  if (runtime.gaps() > 0) {
    damage.push_back(
        {fmt::format("{} gaps of more than {:.0f} s: the {} surfaces that would be of the rest of them are "
                     "left out",
                     runtime.gaps(), to_seconds(kLongestReplayedGap), runtime.releases_passed_over())});
  }
  const auto found = setup.reader.damage();
  damage.insert(damage.end(), found.begin(), found.end());
  return false;
}

Expected<bool> run_live(Pipeline& pipeline, ReplaySetup& setup, Publication& publication, StopSignal& stop,
                        const FrameProgress& progress) {
  RuntimeSettings runtime = runtime_settings(setup.configuration, setup.identity);
  runtime.tools = setup.tools;
  LiveSession session(pipeline, runtime, publication, std::move(setup.reader),
                      [&] { progress(pipeline.counters().frames.get()); });
  return session.run(stop).map([&stop] { return stop.requested(); });
}

ReplayReport report_of(Pipeline& pipeline, const Identity& identity, ReplayPublication& publication) {
  const PipelineCounters& counters = pipeline.counters();
  const PipelineSettings& settings = pipeline.settings();
  ReplayReport report;
  report.lockstep = settings.lockstep;
  report.workers = settings.workers;
  report.frames = counters.frames.get();
  report.frames_without_pose = counters.frames_without_pose.get();
  report.features_converged = counters.features_converged.get();
  for (const ReleaseStream stream : kReleaseStreams) {
    if (!publishes(settings, stream)) continue;
    const StreamCounters& c = counters.of(stream);
    report.streams.push_back({stream, c.samples.get(), c.samples_without_frame.get(), c.samples_from_late_update.get(),
                              c.releases_missed.get(), c.releases_late.get(),
                              stream_counts_json(counted(identity, stream, counters)), publication.report(stream),
                              publication.procedure(stream)});
  }
  report.stages = stages(counters, settings);
  report.breathing = pipeline.status_respiration();
  StatusFacts facts;
  facts.setup = pipeline.setup_watcher().status_belief();
  const perimap_Status status = counted(identity, report.streams.front().stream, counters, facts);
  report.setup = status.setup;
  report.counts = counts(status, counters);
  return report;
}

}  // namespace

tl::expected<ReplayReport, SetupError> run_replay(
    const ReplayOptions& options, StopSignal& stop,
    const std::function<void(std::uint64_t frames, std::uint64_t all)>& progress) {
  auto setup = prepare_replay(options.recording, options.configuration, options.mode);
  if (!setup) return tl::unexpected(std::move(setup.error()));
  setup->pipeline.lockstep = options.lockstep;
  if (options.workers > 0) setup->pipeline.workers = options.workers;
  if (options.simulated != nullptr) {
    if (auto fits = check_size(*options.simulated, setup->pipeline.camera); !fits) return failed(fits.error());
  }
  const auto truth = load_truth(options.recording, options.mode);
  if (!truth) return failed(truth.error());
  Expected<std::vector<RPeak>> beats;
  if (*truth) beats = load_beats(options.recording, options.mode);
  if (!beats) return failed(beats.error());

  const Logging logging(options.program, setup->configuration.log.level);
  std::unique_ptr<PublicationRecorder> recorder;
  if (!options.samples.empty()) {
    auto created = PublicationRecorder::create(options.samples, options.generator, options.lockstep,
                                               static_cast<std::size_t>(setup->pipeline.features.maximum));
    if (!created) return failed(created.error());
    recorder = std::move(*created);
  }
  std::unique_ptr<DdsPublication> dds;
  if (options.dds) {
    const DdsConfiguration& c = setup->configuration.dds;
    DdsSettings settings{{c.domain, c.security}, c.surface_deadline, c.surface_lifespan};
    settings.tools = !setup->tools.empty();
    auto created = DdsPublication::create(settings);
    if (!created) return failed(created.error());
    dds = std::move(*created);
  }
  ReplayPublication publication(*truth ? &**truth : nullptr, *beats, recorder.get(), dds.get());
  const auto tool_truths = load_tool_truths(options.recording, options.mode);
  if (!tool_truths) return failed(tool_truths.error());
  if (options.lockstep) publication.judge_tools(*tool_truths);
  Pipeline pipeline(setup->pipeline);
  const std::uint64_t all = *truth ? (*truth)->captures.size() : 0;
  const FrameProgress frames_done = [&progress, all](std::uint64_t frames) { progress(frames, all); };
  std::vector<Error> damage = std::move(setup->passed_over);
  std::optional<SurfaceWatch> surface;
  if (*truth && options.lockstep) surface.emplace(pipeline, **truth);
  const auto rendered = options.simulated != nullptr ? options.simulated->events(setup->reader) : nullptr;
  const NextEvent next = [&] { return rendered ? rendered->next() : setup->reader.next(); };
  const auto stopped = options.lockstep
                           ? run_lockstep(pipeline, *setup, next, publication, stop, frames_done, damage, surface)
                           : run_live(pipeline, *setup, publication, stop, frames_done);
  if (!stopped) return failed(stopped.error());
  if (recorder) {
    if (const auto finished = recorder->finish(); !finished) return failed(finished.error());
  }
  ReplayReport report = report_of(pipeline, setup->identity, publication);
  report.stopped = *stopped;
  report.has_truth = truth->has_value();
  report.damage = std::move(damage);
  if (surface) report.surface = surface->figures();
  report.tools = publication.tools();
  return report;
}

}  // namespace perimap

#include "daemon/evaluation/commands/replay.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "core/phase/respiratory_clock.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/commands/progress.hpp"
#include "daemon/commands/same_file.hpp"
#include "daemon/evaluation/report/accuracy.hpp"
#include "daemon/evaluation/report/accuracy_text.hpp"
#include "daemon/evaluation/report/recorded_beats.hpp"
#include "daemon/evaluation/report/recorded_truth.hpp"
#include "daemon/logging/logging.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/publishing/dds_publication.hpp"
#include "daemon/publishing/publication_recorder.hpp"
#include "daemon/publishing/status_text.hpp"
#include "daemon/publishing/wire_names.hpp"
#include "daemon/publishing/wire_states.hpp"
#include "daemon/publishing/wire_status.hpp"
#include "daemon/runtime/live_session.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr int kOk = 0;
constexpr int kFailure = 1;
constexpr int kWrongUse = 2;

struct Options {
  std::string recording;
  std::string configuration;
  bool lockstep = false;
  int workers = 0;
  std::string json;
  std::string samples;
  bool dds = false;
  bool whole = false;
};

// Takes what is published to the accuracy report, to the file of samples and to DDS, whichever are there.
class ReplayPublication final : public Publication {
 public:
  ReplayPublication(const RecordedTruth* truth, const std::vector<RPeak>& beats, PublicationRecorder* recorder,
                    Publication* dds)
      : recorder_(recorder), dds_(dds), truth_(truth) {
    if (truth == nullptr) return;
    for (std::size_t i = 0; i < kReleaseStreams.size(); ++i) {
      accuracies_.emplace_back(truth->truth, truth->camera, truth->captures.begin()->second).set_beats(beats);
    }
  }

  void surface(const perimap_Surface& sample) override {
    if (recorder_ != nullptr) recorder_->surface(sample);
    if (dds_ != nullptr) dds_->surface(sample);
    if (accuracies_.empty()) return;
    if (!to_recording_ && rests_on_its_frame(sample.reason)) {
      to_recording_ = truth_->to_recording(sample.frame_sequence, from_ns(sample.capture_time_ns));
    }
    accuracies_[index_of(sample.stream == name_of(ReleaseStream::kClock) ? ReleaseStream::kClock
                                                                         : ReleaseStream::kFrame)]
        .add(sample);
  }
  void surface_model(const perimap_SurfaceModel& model) override {
    if (recorder_ != nullptr) recorder_->surface_model(model);
    if (dds_ != nullptr) dds_->surface_model(model);
    for (Accuracy& accuracy : accuracies_) accuracy.add(model);
  }
  void phase(const perimap_Phase& phase) override {
    if (recorder_ != nullptr) recorder_->phase(phase);
    if (dds_ != nullptr) dds_->phase(phase);
  }
  void status(const perimap_Status& status) override {
    if (recorder_ != nullptr) recorder_->drain();
    if (dds_ != nullptr) dds_->status(status);
  }

  // After every thread that publishes has ended.
  [[nodiscard]] std::optional<AccuracyReport> report(ReleaseStream stream) {
    if (accuracies_.empty() || !to_recording_) return std::nullopt;
    return accuracies_[index_of(stream)].report(*to_recording_);
  }

 private:
  PublicationRecorder* recorder_;
  Publication* dds_;
  const RecordedTruth* truth_;
  std::vector<Accuracy> accuracies_;  // by ReleaseStream; none without a truth
  std::optional<Duration> to_recording_;
};

nlohmann::json to_json(const LatencyHistogram::Summary& s) {
  const auto us = [](Duration d) { return std::chrono::duration<double, std::micro>(d).count(); };
  return {{"count", s.count}, {"p50_us", us(s.p50)}, {"p99_us", us(s.p99)}, {"max_us", us(s.max)}};
}

struct Stage {
  const char* name;
  const LatencyHistogram* histogram;
};

std::vector<Stage> stages(const PipelineCounters& c, const PipelineSettings& settings) {
  std::vector<Stage> all = {{"predict and find", &c.predict_and_find},
                            {"phase and pose", &c.phase_and_pose},
                            {"evaluate", &c.evaluate},
                            {"learn", &c.learn}};
  // Deadlines are virtual in lockstep: nothing is early or late.
  if (!settings.lockstep) {
    all.push_back({"capture to update", &c.capture_to_update});
    if (settings.frame_stream) all.push_back({"release tardiness", &c.of(ReleaseStream::kFrame).release_tardiness});
    if (publishes(settings, ReleaseStream::kClock)) {
      all.push_back({"clock tardiness", &c.of(ReleaseStream::kClock).release_tardiness});
    }
  }
  return all;
}

std::string stage_table(const PipelineCounters& counters, const PipelineSettings& settings) {
  std::string table = fmt::format("{:<18} {:>8} {:>10} {:>10} {:>10}  (us)\n", "stage", "count", "p50", "p99", "max");
  for (const Stage& stage : stages(counters, settings)) {
    const auto s = stage.histogram->summary();
    const auto us = [](Duration d) { return std::chrono::duration<double, std::micro>(d).count(); };
    table += fmt::format("{:<18} {:>8} {:>10.1f} {:>10.1f} {:>10.1f}\n", stage.name, s.count, us(s.p50), us(s.p99),
                         us(s.max));
  }
  return table;
}

// What the status of `stream` counts.
perimap_Status counted(const Identity& identity, ReleaseStream stream, const PipelineCounters& counters) {
  perimap_Status status = WireStatus(identity.of(stream)).fill(counters, {}, Instant{});
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

// A line, or nothing where there is nothing to say.
std::string breath_text(const RespiratoryClock& clock) {
  switch (clock.state) {
    case RespirationState::kSearching:
      return "breathing   not found: positions leave it out\n";
    case RespirationState::kLocked:
      return fmt::format("breathing   {:.2f} s a breath, by the {}\n", to_seconds(clock.period()),
                         clock.source == RespirationSource::kChannel ? "respiration channel" : "images");
    case RespirationState::kOff:
      break;
  }
  return clock.suspected ? "breathing   suspected, and positions leave it out: set respiration.enabled = true\n" : "";
}

int refuse(const Error& error, int code) {
  fmt::print(stderr, "perimap replay: {}\n", error.message);
  return code;
}

struct LockstepEnd {
  std::vector<Error> damage;
  bool stopped = false;
};

Expected<LockstepEnd> run_lockstep(Pipeline& pipeline, ReplaySetup& setup, Publication& publication, Progress& progress,
                                   StopSignal& stop) {
  LockstepRuntime runtime(pipeline, setup.identity, setup.utc_minus_monotonic, publication);
  std::uint64_t shown = 0;
  for (;;) {
    auto event = setup.reader.next();
    if (!event) return tl::unexpected(event.error());
    if (!*event) break;
    runtime.deliver(**event);
    const std::uint64_t frames = pipeline.counters().frames.get();
    if (frames == shown) continue;
    shown = frames;
    progress.update(frames);
    if (stop.requested()) return LockstepEnd{{}, true};
  }
  runtime.finish();
  return LockstepEnd{setup.reader.damage(), false};
}

int replay(const Options& options) {
  for (const auto& [name, file] : {std::pair("--json", options.json), std::pair("--samples", options.samples)}) {
    if (is_same_file(file, options.recording))
      return refuse(Error{fmt::format("{}: is the recording itself", name)}, kWrongUse);
  }
  auto stop = StopSignal::install();
  if (!stop) return refuse(stop.error(), kFailure);
  const ReadMode mode = options.whole ? ReadMode::kWhole : ReadMode::kStrict;
  std::optional<std::filesystem::path> configuration_file;
  if (!options.configuration.empty()) configuration_file = options.configuration;
  auto setup = prepare_replay(options.recording, configuration_file, mode);
  if (!setup) return refuse(setup.error().error, setup.error().configuration ? kWrongUse : kFailure);
  setup->pipeline.lockstep = options.lockstep;
  if (options.workers > 0) setup->pipeline.workers = options.workers;
  const auto truth = load_truth(options.recording, mode);
  if (!truth) return refuse(truth.error(), kFailure);
  Expected<std::vector<RPeak>> beats;
  if (*truth) beats = load_beats(options.recording, mode);
  if (!beats) return refuse(beats.error(), kFailure);

  const Logging logging(setup->configuration.log.level);
  std::unique_ptr<PublicationRecorder> recorder;
  if (!options.samples.empty()) {
    auto created = PublicationRecorder::create(options.samples, "perimap replay " PERIMAP_VERSION, options.lockstep,
                                               static_cast<std::size_t>(setup->pipeline.features.maximum));
    if (!created) return refuse(created.error(), kFailure);
    recorder = std::move(*created);
  }
  std::unique_ptr<DdsPublication> dds;
  if (options.dds) {
    const DdsConfiguration& c = setup->configuration.dds;
    auto created = DdsPublication::create({c.domain, c.surface_deadline, c.surface_lifespan});
    if (!created) return refuse(created.error(), kFailure);
    dds = std::move(*created);
  }
  ReplayPublication publication(*truth ? &**truth : nullptr, *beats, recorder.get(), dds.get());

  std::vector<ReleaseStream> streams;
  for (const ReleaseStream stream : kReleaseStreams) {
    if (publishes(setup->pipeline, stream)) streams.push_back(stream);
  }
  Pipeline pipeline(setup->pipeline);
  bool stopped = false;
  {
    Progress progress("frames", *truth ? (*truth)->captures.size() : 0);
    if (options.lockstep) {
      const auto end = run_lockstep(pipeline, *setup, publication, progress, *stop);
      if (!end) return refuse(end.error(), kFailure);
      for (const Error& damage : end->damage) fmt::print(stderr, "perimap replay: {}\n", damage.message);
      stopped = end->stopped;
    } else {
      LiveSession session(pipeline, runtime_settings(setup->configuration, setup->identity), publication,
                          std::move(setup->reader), [&] { progress.update(pipeline.counters().frames.get()); });
      if (const auto ended = session.run(*stop); !ended) return refuse(ended.error(), kFailure);
      stopped = stop->requested();
    }
  }
  if (recorder) {
    if (const auto finished = recorder->finish(); !finished) return refuse(finished.error(), kFailure);
  }

  const PipelineCounters& counters = pipeline.counters();
  const Identity& identity = setup->identity;
  fmt::print("{}{} frames, {} of them without pose\n", stopped ? "stopped early: " : "", counters.frames.get(),
             counters.frames_without_pose.get());
  for (const ReleaseStream stream : streams) {
    const StreamCounters& c = counters.of(stream);
    fmt::print("stream {}: {} samples ({} without frame, {} from a late update), {} releases missed, {} late\n",
               name_of(stream), c.samples.get(), c.samples_without_frame.get(), c.samples_from_late_update.get(),
               c.releases_missed.get(), c.releases_late.get());
  }
  fmt::print("\n{}\n{}", stage_table(counters, pipeline.settings()), breath_text(pipeline.status_respiration()));
  // The first stream's in its old place, for who knows of no other.
  nlohmann::json accuracy;
  nlohmann::json told_of_streams;
  for (const ReleaseStream stream : streams) {
    nlohmann::json& told = told_of_streams[std::string(name_of(stream))] =
        stream_counts_json(counted(identity, stream, counters));
    const auto report = publication.report(stream);
    if (!report) continue;
    if (streams.size() > 1) fmt::print("stream {}\n", name_of(stream));
    fmt::print("{}\n", to_text(*report));
    (stream == streams.front() ? accuracy : told["accuracy"]) = to_json(*report);
  }
  if (!*truth) {
    fmt::print("no ground truth in this recording: {} features converged\n", counters.features_converged.get());
  }
  if (!options.json.empty()) {
    nlohmann::json json = {{"recording", options.recording},
                           {"lockstep", options.lockstep},
                           {"workers", setup->pipeline.workers},
                           {"counts", counts(counted(identity, streams.front(), counters), counters)},
                           {"streams", told_of_streams}};
    if (!accuracy.is_null()) json["accuracy"] = accuracy;
    const RespiratoryClock breath = pipeline.status_respiration();
    json["breath_s"] = to_seconds(breath.period());
    json["breath_suspected"] = breath.suspected;
    json["breath_state"] = name_of(to_wire(breath.state));
    json["breath_source"] = name_of(to_wire(breath.source));
    for (const Stage& stage : stages(counters, pipeline.settings())) {
      json["stages"][stage.name] = to_json(stage.histogram->summary());
    }
    const auto written = write_text_file(options.json, json.dump(2) + "\n");
    if (!written) return refuse(written.error(), kFailure);
  }
  return kOk;
}

}  // namespace

void add_replay_command(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("replay", "Run the pipeline over a recording and report accuracy and latencies");
  auto options = std::make_shared<Options>();
  command->add_option("RECORDING", options->recording, "The recording (MCAP)")->required();
  command->add_option("-c,--config", options->configuration,
                      "Configuration file; without it the recording's own configuration over the defaults");
  command->add_flag("--lockstep", options->lockstep,
                    "Virtual time, as fast as it goes: the same samples every time (otherwise real time)");
  command->add_option("--workers", options->workers, "Worker threads (default: the configuration's)")
      ->check(CLI::Range(1, 64));
  command->add_option("--json", options->json, "Write the report as JSON to this file");
  command->add_option("--samples", options->samples, "Write every published sample to this recording (MCAP)");
  command->add_flag("--dds", options->dds, "Publish over DDS too");
  command->add_flag("--whole", options->whole, "Use what is whole of a damaged recording, and say what is not");
  command->callback([options, &exit_code] { exit_code = replay(*options); });
}

}  // namespace perimap

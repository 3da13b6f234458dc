#include "daemon/runtime/live_runtime.hpp"

#include <algorithm>
#include <utility>

#include "core/pipeline/batch_starter.hpp"
#include "core/pipeline/feature_finder.hpp"
#include "core/pipeline/frame_trace.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/release_plan.hpp"
#include "core/pipeline/scope_watch.hpp"
#include "core/pipeline/sensor_entrance.hpp"
#include "core/pipeline/setup_watcher.hpp"
#include "core/pipeline/surface_maker.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "core/realtime/deadline.hpp"
#include "core/realtime/worker_team.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/latency_check.hpp"
#include "daemon/runtime/model_moment.hpp"
#include "daemon/runtime/utc_offset.hpp"

namespace perimap {
namespace {

// How long before its deadline a surface is composed, so that the deadline is for the write alone; what an update
// brings later than this is late. Measured: 200 features take 0.05 ms.
constexpr Duration kComposing = std::chrono::microseconds(500);

}  // namespace

LiveRuntime::LiveRuntime(Pipeline& pipeline, const RuntimeSettings& settings, Publication& publication,
                         std::function<void()> on_status_tick)
    : pipeline_(pipeline),
      settings_(settings),
      threads_(settings.scheduling),
      publication_(publication),
      on_status_tick_(std::move(on_status_tick)),
      wire_surfaces_(wire_surfaces(settings.identity, pipeline.settings())),
      wire_model_(settings.identity),
      wire_mesh_(settings.identity),
      wire_phase_(settings.identity),
      wire_statuses_(wire_statuses(settings.identity, pipeline.settings())),
      tools_(tool_teller(pipeline, settings.identity, settings.tools, publication)) {}

void LiveRuntime::start() {
  memory_locked_ = lock_memory(settings_.lock_memory);
  for (int i = 0; i < pipeline_.team().size(); ++i) {
    workers_.push_back(threads_.launch(
        "worker-" + std::to_string(i), ThreadRole::kWorker, [this, i] { pipeline_.team().serve(i); }, i));
  }
  const auto housekeeping = ThreadRole::kHousekeeping;
  housekeepers_.push_back(threads_.launch("finder", housekeeping, [this] { pipeline_.finder().serve(); }));
  housekeepers_.push_back(threads_.launch("starter", housekeeping, [this] { pipeline_.starter().serve(); }));
  housekeepers_.push_back(
      threads_.launch("surface", ThreadRole::kBackground, [this] { pipeline_.surface_maker().serve(); }));
  housekeepers_.push_back(
      threads_.launch("setup-watch", ThreadRole::kBackground, [this] { pipeline_.setup_watcher().serve(); }));
  if (ScopeWatch* scope = pipeline_.scope()) {
    housekeepers_.push_back(threads_.launch("scope", housekeeping, [scope] { scope->serve(); }));
  }
  if (tools_) housekeepers_.push_back(threads_.launch("tools", housekeeping, [this] { tools_->serve(); }));
  mapper_ = threads_.launch("mapper", ThreadRole::kMapper, [this] { run_mapper(); });
  publisher_ = threads_.launch("publisher", ThreadRole::kPublisher, [this] { run_publisher(); });
  status_ = threads_.launch("status", housekeeping, [this] { run_status(); });
  started_ = true;
}

void LiveRuntime::end_of_sources() noexcept {
  sources_ended_.store(true, std::memory_order_relaxed);
  pipeline_.entrance().publisher_wakeup().post();
}

void LiveRuntime::stop() {
  if (!started_) return;
  started_ = false;
  stopping_.store(true, std::memory_order_relaxed);
  pipeline_.entrance().mapper_wakeup().post();
  pipeline_.entrance().publisher_wakeup().post();
  status_wakeup_.post();
  mapper_.join();
  publisher_.join();
  status_.join();
  pipeline_.team().dismiss();
  for (std::thread& worker : workers_) worker.join();
  pipeline_.finder().dismiss();
  pipeline_.starter().dismiss();
  pipeline_.surface_maker().dismiss();
  pipeline_.setup_watcher().dismiss();
  if (ScopeWatch* scope = pipeline_.scope()) scope->dismiss();
  if (tools_) tools_->dismiss();
  for (std::thread& housekeeper : housekeepers_) housekeeper.join();
}

StatusFacts LiveRuntime::facts() const {
  StatusFacts facts;
  facts.memory_locked = memory_locked_;
  facts.realtime_priority = threads_.priority();
  facts.latency = pipeline_.settings().latency;
  facts.latency_short = check_latency(pipeline_.settings(), pipeline_.counters()).too_short;
  facts.stalled_after = settings_.stalled_after;
  facts.recent = &recent_;
  facts.r_trigger = pipeline_.settings().r_trigger.has_value();
  facts.respiration_channel = pipeline_.settings().respiration.channel;
  facts.sources_ended = sources_ended_.load(std::memory_order_relaxed);
  facts.two_publishers = publication_.another_publisher();
  facts.keys_expire_utc_ns = settings_.keys_expire_utc_ns;
  const std::lock_guard lock(beliefs_mutex_);
  facts.phase = beliefs_.phase;
  facts.rhythm = beliefs_.rhythm;
  facts.respiration = beliefs_.respiration;
  facts.respiration_suspected = beliefs_.respiration_suspected;
  facts.respiration_source = beliefs_.respiration_source;
  facts.setup = beliefs_.setup;
  return facts;
}

void LiveRuntime::run_mapper() noexcept {
  SensorEntrance& entrance = pipeline_.entrance();
  const PipelineSettings& settings = pipeline_.settings();
  for (;;) {
    // Posts are cleared before what they announce is looked for, the request to stop included; uncleared they would
    // pile up and every wait would return at once.
    entrance.mapper_wakeup().clear();
    if (stopping_.load(std::memory_order_relaxed)) return;
    pipeline_.forget_if_asked();
    pipeline_.move_map_if_asked();
    pipeline_.drain_poses();
    FrameHandle frame;
    if (!entrance.pop_frame(frame)) {
      entrance.mapper_wakeup().wait();
      continue;
    }
    {
      FrameTrace* const trace = pipeline_.trace();
      const FrameSpan span(trace != nullptr ? &trace->mapper : nullptr, FramePart::kAwaitPose, frame.stamp.sequence);
      // The named wait: for the tracker to reach the capture, at most until the budget before the release.
      const Instant latest = frame.stamp.capture + settings.latency - settings.budget;
      while (!pipeline_.pose_reached(frame.stamp.capture) && entrance.mapper_wakeup().wait_until(latest)) {
        pipeline_.drain_poses();
        if (stopping_.load(std::memory_order_relaxed)) break;
      }
    }
    pipeline_.map(frame);
  }
}

void LiveRuntime::run_publisher() {
  Wakeup& wakeup = pipeline_.entrance().publisher_wakeup();
  PipelineCounters& counters = pipeline_.counters();
  for (;;) {
    wakeup.clear();  // before looking, as in run_mapper()
    publisher_beats_.add();
    if (stopping_.load(std::memory_order_relaxed)) return;
    const Instant now = MonotonicClock::now();
    pipeline_.drain_stamps(now);
    pipeline_.leave_out_missed(now);
    const auto next = pipeline_.plan().next();
    const bool done = sources_ended_.load(std::memory_order_relaxed) && !pipeline_.plan().pending();
    if (done) all_released_.store(true, std::memory_order_relaxed);
    const Instant round_ends = now + kLongestPublisherRound;
    if (done || !next || next->deadline - kComposing > round_ends) {
      static_cast<void>(wakeup.wait_until(round_ends));
      continue;
    }
    // What is provisional waits for a frame that still comes and takes its place, or has a release before it.
    if (ReleasePlan::provisional(*next) && wakeup.wait_until(next->deadline - kComposing)) continue;
    sleep_until(next->deadline - kComposing);
    const Release release = pipeline_.plan().take_release();
    WireSurface& wire = wire_surfaces_[index_of(release.stream)];
    const Instant begin = MonotonicClock::now();
    const SurfaceSample& surface = pipeline_.compose(release);
    const perimap_Surface& sample = wire.fill(surface, utc_minus_monotonic());
    const Instant composed = MonotonicClock::now();
    wait_until_exactly(release.deadline);
    const Instant ready = MonotonicClock::now();
    if (pipeline_.plan().stale(release, ready)) {
      pipeline_.take_back(surface);
      continue;
    }
    // Cyclone DDS allocates, locks and calls the kernel, so that this alone is in no RealtimeScope; all that the
    // surface is made of was made before.
    publication_.surface(sample);
    StreamCounters& stream = counters.of(release.stream);
    const Instant written = MonotonicClock::now();
    stream.dds_write.add(written - ready);
    pipeline_.sent(surface);
    if (tools_) tools_->sent(surface);
    stream.count_tardiness(ready - release.deadline);
    if (FrameTrace* const trace = pipeline_.trace()) {
      trace->releases.add({release, surface.update_late, begin, composed, ready, written});
    }
  }
}

void LiveRuntime::run_status() {
  Instant tick = MonotonicClock::now();
  Instant next_model = tick;
  Instant next_status = tick;
  SourceStates states_before{};
  std::pair<std::uint64_t, SurfaceReason> turn_before;
  for (;;) {
    const bool last = stopping_.load(std::memory_order_relaxed);
    const Instant now = MonotonicClock::now();
    recent_.note(pipeline_.counters(), now);
    const CardiacClock clock = pipeline_.status_clock(now);
    const RespiratoryClock respiration = pipeline_.status_respiration();
    publication_.phase(wire_phase_.fill(clock, now));
    ModelMoment moment = model_moment(pipeline_, clock, respiration, now);
    // A subscriber that predicts with the model must not go on from a beat before the last, nor from a state that was.
    const auto turn = std::pair(clock.beats(), reason_of(clock.at(now), clock.rhythm(), moment.footing));
    if (last || now >= next_model || turn != turn_before) {
      moment.utc_minus_monotonic = utc_minus_monotonic();
      moment.validity += settings_.model_interval;
      publication_.surface_model(wire_model_.fill(moment));
      next_model = now + settings_.model_interval;
      turn_before = turn;
    }
    const perimap_SurfaceMesh* mesh = wire_mesh_.news(pipeline_.surface_maker(), now, utc_minus_monotonic());
    if (mesh != nullptr) publication_.surface_mesh(*mesh);
    {
      const std::lock_guard lock(beliefs_mutex_);
      beliefs_ = {clock.at(now).state,   clock.rhythm(),     respiration.state,
                  respiration.suspected, respiration.source, pipeline_.setup_watcher().status_belief()};
    }
    StatusFacts told = facts();
    if (describe_sources_) describe_sources_(told);
    // A device that goes, comes or falls silent is told at once.
    const SourceStates states = source_states(pipeline_.counters(), told, now);
    if (last || now >= next_status || states != states_before) {
      for (WireStatus& wire : wire_statuses_) publication_.status(wire.fill(pipeline_.counters(), told, now));
      next_status = now + settings_.status_interval;
      states_before = states;
    }
    if (on_status_tick_) on_status_tick_();
    if (last) return;
    tick = std::max(tick + settings_.phase_interval, now);
    // Woken early only to stop.
    static_cast<void>(status_wakeup_.wait_until(tick));
  }
}

}  // namespace perimap

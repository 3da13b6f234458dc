#include "daemon/runtime/lockstep_runtime.hpp"

#include <algorithm>
#include <variant>

#include "core/pipeline/batch_starter.hpp"
#include "core/pipeline/feature_finder.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/release_plan.hpp"
#include "core/pipeline/scope_watch.hpp"
#include "core/pipeline/sensor_entrance.hpp"
#include "core/pipeline/setup_watcher.hpp"
#include "core/pipeline/surface_maker.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "core/realtime/worker_team.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/model_moment.hpp"

namespace perimap {
namespace {

constexpr Duration kReportInterval = std::chrono::milliseconds(500);

}  // namespace

LockstepRuntime::LockstepRuntime(Pipeline& pipeline, const Identity& identity, Duration utc_minus_monotonic,
                                 Publication& publication, const std::vector<WatchedTool>& tools)
    : pipeline_(pipeline),
      utc_minus_monotonic_(utc_minus_monotonic),
      publication_(publication),
      wire_surfaces_(wire_surfaces(identity, pipeline.settings())),
      wire_model_(identity),
      wire_mesh_(identity),
      wire_phase_(identity),
      wire_statuses_(wire_statuses(identity, pipeline.settings())),
      tools_(tool_teller(pipeline, identity, tools, publication)) {
  for (int i = 0; i < pipeline_.team().size(); ++i) {
    threads_.emplace_back([this, i] { pipeline_.team().serve(i); });
  }
  threads_.emplace_back([this] { pipeline_.finder().serve(); });
  threads_.emplace_back([this] { pipeline_.starter().serve(); });
  threads_.emplace_back([this] { pipeline_.surface_maker().serve(); });
  threads_.emplace_back([this] { pipeline_.setup_watcher().serve(); });
  if (ScopeWatch* scope = pipeline_.scope()) threads_.emplace_back([scope] { scope->serve(); });
}

LockstepRuntime::~LockstepRuntime() {
  pipeline_.team().dismiss();
  pipeline_.finder().dismiss();
  pipeline_.starter().dismiss();
  pipeline_.surface_maker().dismiss();
  pipeline_.setup_watcher().dismiss();
  if (ScopeWatch* scope = pipeline_.scope()) scope->dismiss();
  for (std::thread& thread : threads_) thread.join();
}

void LockstepRuntime::deliver(const ReplayEvent& event) {
  const Instant arrival = arrival_of(event);
  if (delivered_any_ && arrival - now_ > kLongestReplayedGap) pass_over_gap(arrival);
  delivered_any_ = true;
  advance_to(arrival);
  now_ = std::max(now_, arrival);
  SensorEntrance& entrance = pipeline_.entrance();
  if (const auto* frame = std::get_if<FrameEvent>(&event)) {
    // Live, several frames may wait; in virtual time the one before has to be mapped first.
    if (frame_waits_) map_ready_frame();
    static_cast<void>(entrance.push_frame(frame->stamp, frame->image(), frame->colour()));
    pipeline_.drain_stamps(now_);
    frame_waits_ = entrance.pop_frame(frame_);
  } else if (const auto* other = std::get_if<ToolSample>(&event)) {
    if (tools_) tools_->push(*other);
  } else if (const auto* pose = std::get_if<TrackerSample>(&event)) {
    entrance.push_pose(*pose);
    pipeline_.drain_poses();
  } else if (const auto* tool = std::get_if<ToolPose>(&event)) {
    entrance.push_tool_pose(*tool);
    pipeline_.drain_poses();
  } else if (const auto* ecg = std::get_if<EcgBlock>(&event)) {
    entrance.push_ecg(*ecg);
  } else if (const auto* respiration = std::get_if<RespirationBlock>(&event)) {
    entrance.push_respiration(*respiration);
  } else {
    entrance.push_r_trigger(std::get<RTriggerPulse>(event));
  }
  if (frame_waits_ && pipeline_.pose_reached(frame_.stamp.capture)) map_ready_frame();
}

void LockstepRuntime::finish() {
  if (frame_waits_) map_ready_frame();
  while (pipeline_.plan().pending()) {
    now_ = std::max(now_, pipeline_.plan().next()->deadline);
    release();
  }
  publish_reports(now_);
}

// Runs what falls due before t, in order: the end of a wait for a pose, and releases.
void LockstepRuntime::advance_to(Instant t) {
  const PipelineSettings& settings = pipeline_.settings();
  for (;;) {
    const auto next = pipeline_.plan().next();
    const Instant release_at = next ? next->deadline : Instant::max();
    const Instant map_at = frame_waits_ ? frame_.stamp.capture + settings.latency - settings.budget : Instant::max();
    const Instant first = std::min(release_at, map_at);
    if (first > t || first == Instant::max()) return;
    now_ = std::max(now_, first);
    if (map_at <= release_at) {
      map_ready_frame();
    } else {
      release();
    }
  }
}

// Its beginning as any other silence: until then all that was known has lost its meaning, and says so.
void LockstepRuntime::pass_over_gap(Instant until) {
  advance_to(now_ + kLongestReplayedGap);
  ++gaps_;
  releases_passed_over_ += pipeline_.plan().pass_over(until);
}

void LockstepRuntime::map_ready_frame() {
  frame_waits_ = false;
  pipeline_.map(frame_);
}

void LockstepRuntime::release() {
  const Release release = pipeline_.plan().take_release();
  WireSurface& wire = wire_surfaces_[index_of(release.stream)];
  const SurfaceSample& surface = pipeline_.compose(release);
  publication_.surface(wire.fill(surface, utc_minus_monotonic_));
  pipeline_.sent(surface);
  if (tools_) tools_->tell(surface, utc_minus_monotonic_);
  if (now_ >= next_reports_) {
    publish_reports(now_);
    next_reports_ = now_ + kReportInterval;
  }
}

void LockstepRuntime::publish_reports(Instant now) {
  const CardiacClock clock = pipeline_.status_clock(now);
  publication_.phase(wire_phase_.fill(clock, now));
  const RespiratoryClock respiration = pipeline_.status_respiration();
  ModelMoment moment = model_moment(pipeline_, clock, respiration, now);
  moment.utc_minus_monotonic = utc_minus_monotonic_;
  moment.validity += kReportInterval;
  publication_.surface_model(wire_model_.fill(moment));
  const perimap_SurfaceMesh* mesh = wire_mesh_.news(pipeline_.surface_maker(), now, utc_minus_monotonic_);
  if (mesh != nullptr) publication_.surface_mesh(*mesh);
  StatusFacts facts;
  facts.latency = pipeline_.settings().latency;
  facts.respiration = respiration.state;
  facts.respiration_suspected = respiration.suspected;
  facts.respiration_source = respiration.source;
  facts.setup = pipeline_.setup_watcher().status_belief();
  facts.phase = clock.at(now).state;
  facts.rhythm = clock.rhythm();
  facts.r_trigger = pipeline_.settings().r_trigger.has_value();
  facts.respiration_channel = pipeline_.settings().respiration.channel;
  facts.stalled_after = std::chrono::milliseconds(500);
  for (WireStatus& wire : wire_statuses_) publication_.status(wire.fill(pipeline_.counters(), facts, now));
}

}  // namespace perimap

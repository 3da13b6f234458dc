#include "daemon/runtime/live_session.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <string>
#include <utility>

#include "daemon/runtime/replay_feeder.hpp"

namespace perimap {
namespace {

constexpr Duration kTick = std::chrono::milliseconds(100);
constexpr std::uint64_t kFramesForLatencyCheck = 60;
constexpr std::uint64_t kTicksAStatus = 10;

double milliseconds(Duration d) { return std::chrono::duration<double, std::milli>(d).count(); }

}  // namespace

LiveSession::LiveSession(Pipeline& pipeline, const RuntimeSettings& settings, Publication& publication,
                         ReplayReader reader, std::function<void()> on_tick)
    : LiveSession(pipeline, settings, publication,
                  std::make_unique<ReplayFeeder>(std::move(reader), SensorIntake{&pipeline.entrance()}),
                  std::move(on_tick)) {}

LiveSession::LiveSession(Pipeline& pipeline, const RuntimeSettings& settings, Publication& publication,
                         std::unique_ptr<SensorFeeder> feeder, std::function<void()> on_tick)
    : pipeline_(pipeline),
      runtime_(pipeline, settings, publication),
      feeder_(std::move(feeder)),
      on_tick_(std::move(on_tick)) {}

Expected<void> LiveSession::run(StopSignal& stop) {
  runtime_.describe_sources_by([this](StatusFacts& facts) { feeder_->describe(facts); });
  runtime_.start();
  feeder_->start(runtime_.threads());
  // Ready with no device there as well: it publishes what it knows, and its status says what is missing.
  if (service_ != nullptr) service_->ready();
  bool told_end = false;
  while (!stop.wait_for(kTick)) {
    if (on_tick_) on_tick_();
    feeder_->tick();
    report();
    warn_of_refused_privileges();
    warn_of_short_latency();
    if (!told_end && feeder_->ended()) {
      runtime_.end_of_sources();
      told_end = true;
    }
    if (told_end && runtime_.all_released()) break;
  }
  if (service_ != nullptr) service_->stopping();
  feeder_->stop();
  runtime_.stop();
  if (const auto failed = pipeline_.counters().searches_failed.get(); failed > 0) {
    spdlog::warn("{} searches for new features failed", failed);
  }
  if (!feeder_->ended()) return {};
  for (const Error& damage : feeder_->damage()) spdlog::warn("{}", damage.message);
  if (feeder_->error()) return tl::unexpected(*feeder_->error());
  return {};
}

// The watchdog is fed from here with the publisher's beats, so that neither thread may hang, and the publisher itself
// never calls the kernel for it.
void LiveSession::report() {
  if (service_ == nullptr) return;
  service_->feed_watchdog(runtime_.publisher_beats(), MonotonicClock::now());
  if (ticks_++ % kTicksAStatus != 0) return;
  StatusFacts facts = runtime_.facts();
  feeder_->describe(facts);
  const PipelineCounters& counters = pipeline_.counters();
  std::string line = fmt::format("{} surfaces published, {} features converged", counters.samples.get(),
                                 counters.features_converged.get());
  const auto age = [now = to_ns(MonotonicClock::now())](const Counter& last_ns) {
    return Duration(now - static_cast<std::int64_t>(last_ns.get()));
  };
  const auto add = [&](const char* source, const SourceLink& link, const Counter& last_ns) {
    if (link.closed) {
      line += fmt::format(", {} closed", source);
    } else if (last_ns.get() == 0) {
      line += fmt::format(", nothing from the {} yet", source);
    } else if (age(last_ns) > facts.stalled_after) {
      line += fmt::format(", {} silent", source);
    }
  };
  add("camera", facts.camera, counters.last_frame_ns);
  add("tracker", facts.tracker, counters.last_pose_ns);
  add("ECG", facts.ecg, counters.last_ecg_ns);
  service_->tell_status(line);
}

// On the first tick: by then every thread has asked for what it was to ask for.
void LiveSession::warn_of_refused_privileges() {
  if (privileges_told_) return;
  privileges_told_ = true;
  const StatusFacts facts = runtime_.facts();
  if (facts.memory_locked == perimap_PRIVILEGE_REFUSED) {
    spdlog::warn("memory is not locked: needs an unlimited RLIMIT_MEMLOCK (LimitMEMLOCK=infinity); running on without");
  }
  if (facts.realtime_priority == perimap_PRIVILEGE_REFUSED) {
    spdlog::warn("real-time priority refused: needs RLIMIT_RTPRIO (LimitRTPRIO=); running on without");
  }
}

// L must leave room for what a frame takes to arrive and for the budget; otherwise every update would be late.
void LiveSession::warn_of_short_latency() {
  const LatencyHistogram::Summary delay = pipeline_.counters().camera_delay.summary();
  if (latency_checked_ || delay.count < kFramesForLatencyCheck) return;
  latency_checked_ = true;
  const PipelineSettings& settings = pipeline_.settings();
  if (delay.p99 + settings.budget <= settings.latency) return;
  spdlog::warn(
      "latency {:.1f} ms is too short: frames arrive up to {:.1f} ms after capture and the budget is {:.1f} ms",
      milliseconds(settings.latency), milliseconds(delay.p99), milliseconds(settings.budget));
}

}  // namespace perimap

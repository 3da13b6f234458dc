#include "daemon/runtime/live_session.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <string>
#include <utility>

#include "core/error/one_line.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/sensor_entrance.hpp"
#include "daemon/black_box/black_box.hpp"
#include "daemon/checkpoint/checkpoint_keeper.hpp"
#include "daemon/control/control_server.hpp"
#include "daemon/process/reload_signal.hpp"
#include "daemon/process/service_manager.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/publishing/setup_text.hpp"
#include "daemon/publishing/status_text.hpp"
#include "daemon/runtime/latency_check.hpp"
#include "daemon/runtime/replay_feeder.hpp"
#include "daemon/runtime/sensor_feeder.hpp"
#include "daemon/runtime/session_commands.hpp"
#include "drivers/recording/replay_reader.hpp"

namespace perimap {
namespace {

constexpr Duration kTick = std::chrono::milliseconds(100);
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
      on_tick_(std::move(on_tick)),
      identity_(settings.identity),
      service_status_(settings.identity) {
  feeder_->give_tools_to(runtime_.tools());
}

LiveSession::~LiveSession() = default;

void LiveSession::keep_checkpoints(std::unique_ptr<CheckpointKeeper> keeper) { keeper_ = std::move(keeper); }

void LiveSession::take_commands_at(std::string socket, std::function<Expected<std::string>()> reload) {
  control_socket_ = std::move(socket);
  reload_ = std::move(reload);
}

void LiveSession::reload_at(ReloadSignal& signal, std::function<Expected<std::string>()> reload) {
  reload_signal_ = &signal;
  reload_at_signal_ = std::move(reload);
}

StatusFacts LiveSession::facts() const {
  StatusFacts facts = runtime_.facts();
  feeder_->describe(facts);
  return facts;
}

Expected<void> LiveSession::start_control() {
  if (control_socket_.empty()) return {};
  commands_ = std::make_unique<SessionCommands>(
      pipeline_, identity_, [this] { return facts(); }, reload_, [this](bool on) { return feeder_->record(on); },
      [this](std::uint64_t forgotten_before) {
        if (keeper_) keeper_->forget(forgotten_before);
      });
  auto server = ControlServer::create(control_socket_, [this](ControlCommand command) { return answer(command); });
  if (!server) return tl::unexpected(std::move(server.error()));
  control_ = std::make_unique<ControlServer>(std::move(*server));
  control_thread_ =
      runtime_.threads().launch("control", ThreadRole::kHousekeeping, [this] { control_->serve(control_interrupt_); });
  return {};
}

// The thread that takes commands.
Expected<std::string> LiveSession::answer(ControlCommand command) {
  Expected<std::string> answer = commands_->answer(command);
  if (box_ != nullptr) {
    box_->command(name_of(command), answer.has_value(), answer ? *answer : answer.error().message);
  }
  return answer;
}

void LiveSession::stop_control() {
  if (!control_thread_.joinable()) return;
  control_interrupt_.request();
  control_thread_.join();
  control_.reset();
}

// On a thread of its own: a disk that hangs must not keep run() from feeding the watchdog.
void LiveSession::start_reloading() {
  if (reload_signal_ == nullptr) return;
  reload_thread_ = runtime_.threads().launch("reload", ThreadRole::kHousekeeping, [this] {
    while (reload_signal_->wait(reload_interrupt_.descriptor())) {
      if (const auto done = reload_at_signal_()) {
        spdlog::info("SIGHUP: the configuration is read again: {}", on_one_line(*done));
      } else {
        spdlog::warn("SIGHUP: the configuration stays as it was: {}", on_one_line(done.error().message));
      }
    }
  });
}

void LiveSession::stop_reloading() {
  if (!reload_thread_.joinable()) return;
  reload_interrupt_.request();
  reload_thread_.join();
}

Expected<void> LiveSession::run(StopSignal& stop) {
  if (auto started = start_control(); !started) return started;
  start_reloading();
  if (box_ != nullptr) {
    box_thread_ = runtime_.threads().launch("black-box", ThreadRole::kHousekeeping, [this] { box_->run(); });
  }
  runtime_.describe_sources_by([this](StatusFacts& facts) { feeder_->describe(facts); });
  runtime_.start();
  feeder_->start(runtime_.threads());
  if (keeper_) {
    checkpoint_thread_ = runtime_.threads().launch("checkpoint", ThreadRole::kHousekeeping, [this] { keeper_->run(); });
  }
  // Ready with no device there as well: it publishes what it knows, and its status says what is missing.
  if (service_ != nullptr) service_->ready();
  bool told_end = false;
  while (!stop.wait_for(kTick)) {
    if (on_tick_) on_tick_();
    feeder_->tick();
    report();
    warn_of_refused_privileges();
    warn_of_short_latency();
    tell_of_shedding();
    tell_of_setup();
    if (pipeline_.scope() != nullptr) scope_news_.tell(pipeline_.counters(), MonotonicClock::now());
    if (const auto line = ecg_lead_news_.next(pipeline_.counters(), MonotonicClock::now())) {
      spdlog::log(line->warning ? spdlog::level::warn : spdlog::level::info, "{}", line->text);
    }
    if (!told_end && feeder_->ended()) {
      runtime_.end_of_sources();
      told_end = true;
    }
    if (told_end && runtime_.all_released()) break;
  }
  if (service_ != nullptr) service_->stopping();
  stop_control();
  stop_reloading();
  if (checkpoint_thread_.joinable()) {
    keeper_->stop();
    checkpoint_thread_.join();
  }
  feeder_->stop();
  runtime_.stop();
  // After the last that is published.
  if (box_thread_.joinable()) {
    box_->stop();
    box_thread_.join();
  }
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
  service_->tell_status(status_line(service_status_.fill(pipeline_.counters(), facts(), MonotonicClock::now())));
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

// L must leave room for what a frame and its pose take to arrive and for the budget; otherwise every update would be
// late, or without its pose.
void LiveSession::warn_of_short_latency() {
  if (latency_checked_) return;
  const PipelineSettings& settings = pipeline_.settings();
  const LatencyCheck check = check_latency(settings, pipeline_.counters());
  latency_checked_ = check.told || check.too_short;
  if (!check.too_short) return;
  spdlog::warn("latency {:.1f} ms is too short: {} up to {:.1f} ms after capture and the budget is {:.1f} ms",
               milliseconds(settings.latency), check.by_pose ? "poses for it arrive" : "frames arrive",
               milliseconds(check.arrival), milliseconds(settings.budget));
}

// How often and how far it goes on is in the status.
void LiveSession::tell_of_shedding() {
  const std::uint64_t shed = pipeline_.counters().features_shed.get();
  if ((shed > 0) == shedding_told_) return;
  shedding_told_ = shed > 0;
  if (shed > 0) {
    spdlog::warn("frames take longer than the budget of {:.1f} ms: {} of the least useful features are shed",
                 milliseconds(pipeline_.settings().budget), shed);
  } else {
    spdlog::info("all features are looked for again");
  }
}

// Each time that it is doubted, or is not any more; by how much goes on in the status.
void LiveSession::tell_of_setup() {
  if (++setup_ticks_ % kTicksAStatus != 0) return;
  const perimap_SetupWatch& setup = service_status_.fill(pipeline_.counters(), facts(), MonotonicClock::now()).setup;
  const bool doubted = setup.state == perimap_SETUP_DOUBTED;
  if (doubted == setup_told_) return;
  setup_told_ = doubted;
  if (doubted) {
    spdlog::warn("the set-up is {}", setup_words(setup));
  } else {
    spdlog::info("the set-up is not doubted any more");
  }
}

}  // namespace perimap

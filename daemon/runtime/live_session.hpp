// A pipeline run live, over a recording or over devices, from start to a stop signal or the end of what is played.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "core/error/expected.hpp"
#include "daemon/control/control_request.hpp"
#include "daemon/publishing/identity.hpp"
#include "daemon/publishing/wire_status.hpp"
#include "daemon/runtime/ecg_lead_news.hpp"
#include "daemon/runtime/live_runtime.hpp"
#include "daemon/runtime/scope_news.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

namespace black_box {
class BlackBox;
}
class CheckpointKeeper;
class ControlServer;
class Pipeline;
class Publication;
class ReloadSignal;
class ReplayReader;
class SensorFeeder;
class ServiceManager;
class SessionCommands;
class StopSignal;

class LiveSession {
 public:
  // `on_tick`: called about ten times a second by the thread that runs run(), for progress shown to a user.
  LiveSession(Pipeline& pipeline, const RuntimeSettings& settings, Publication& publication, ReplayReader reader,
              std::function<void()> on_tick = {});

  // Over whatever feeds the entrance.
  LiveSession(Pipeline& pipeline, const RuntimeSettings& settings, Publication& publication,
              std::unique_ptr<SensorFeeder> feeder, std::function<void()> on_tick = {});

  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;
  ~LiveSession();

  // Before run(): `service` is told of readiness, health and end. It must outlive this.
  void report_to(ServiceManager& service) noexcept { service_ = &service; }

  // Before run(): commands are taken at `socket` while it runs, and `reload` is what the command of that name does.
  void take_commands_at(std::string socket, std::function<Expected<std::string>()> reload);

  // Before run(): while it runs, the signal does the same.
  void reload_at(ReloadSignal& signal, std::function<Expected<std::string>()> reload);

  // Before run(): `keeper`, over the same pipeline, keeps checkpoints while it runs.
  void keep_checkpoints(std::unique_ptr<CheckpointKeeper> keeper);

  // Before run(): `box`, which must outlive this, is written while it runs, and told of commands.
  void keep_black_box(black_box::BlackBox& box) noexcept { box_ = &box; }

  // Returns when every surface of the recording is released, or on a stop signal; an error when reading failed.
  [[nodiscard]] Expected<void> run(StopSignal& stop);

 private:
  [[nodiscard]] Expected<void> start_control();
  void stop_control();
  [[nodiscard]] Expected<std::string> answer(ControlCommand command);
  void start_reloading();
  void stop_reloading();
  [[nodiscard]] StatusFacts facts() const;
  void report();
  void warn_of_refused_privileges();
  void warn_of_short_latency();
  void tell_of_shedding();
  void tell_of_setup();

  Pipeline& pipeline_;
  LiveRuntime runtime_;
  std::unique_ptr<SensorFeeder> feeder_;
  std::function<void()> on_tick_;
  ServiceManager* service_ = nullptr;
  Identity identity_;
  WireStatus service_status_;
  std::uint64_t ticks_ = 0;
  std::string control_socket_;
  std::function<Expected<std::string>()> reload_;
  std::unique_ptr<SessionCommands> commands_;
  std::unique_ptr<ControlServer> control_;
  Interrupt control_interrupt_;
  std::thread control_thread_;
  ReloadSignal* reload_signal_ = nullptr;
  std::function<Expected<std::string>()> reload_at_signal_;
  Interrupt reload_interrupt_;
  std::thread reload_thread_;
  std::unique_ptr<CheckpointKeeper> keeper_;
  std::thread checkpoint_thread_;
  black_box::BlackBox* box_ = nullptr;
  std::thread box_thread_;
  bool privileges_told_ = false;
  bool latency_checked_ = false;
  bool shedding_told_ = false;
  std::uint64_t setup_ticks_ = 0;
  bool setup_told_ = false;
  ScopeNews scope_news_;
  EcgLeadNews ecg_lead_news_;
};

}  // namespace perimap

// A pipeline run live, over a recording or over devices, from start to a stop signal or the end of what is played.
#pragma once

#include <functional>
#include <memory>

#include "core/error/expected.hpp"
#include "core/pipeline/pipeline.hpp"
#include "daemon/process/service_manager.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/live_runtime.hpp"
#include "daemon/runtime/sensor_feeder.hpp"
#include "drivers/recording/replay_reader.hpp"

namespace perimap {

class LiveSession {
 public:
  // `on_tick`: called about ten times a second by the thread that runs run(), for progress shown to a user.
  LiveSession(Pipeline& pipeline, const RuntimeSettings& settings, Publication& publication, ReplayReader reader,
              std::function<void()> on_tick = {});

  // Over whatever feeds the entrance.
  LiveSession(Pipeline& pipeline, const RuntimeSettings& settings, Publication& publication,
              std::unique_ptr<SensorFeeder> feeder, std::function<void()> on_tick = {});

  // Before run(): `service` is told of readiness, health and end. It must outlive this.
  void report_to(ServiceManager& service) noexcept { service_ = &service; }

  // Returns when every surface of the recording is released, or on a stop signal; an error when reading failed.
  [[nodiscard]] Expected<void> run(StopSignal& stop);

 private:
  void report();
  void warn_of_refused_privileges();
  void warn_of_short_latency();

  Pipeline& pipeline_;
  LiveRuntime runtime_;
  std::unique_ptr<SensorFeeder> feeder_;
  std::function<void()> on_tick_;
  ServiceManager* service_ = nullptr;
  std::uint64_t ticks_ = 0;
  bool privileges_told_ = false;
  bool latency_checked_ = false;
};

}  // namespace perimap

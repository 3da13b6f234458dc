// The daemon's threads over a pipeline: what they run, how they start and how they end.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/realtime/counter.hpp"
#include "core/realtime/wakeup.hpp"
#include "core/tool/tool_distance.hpp"
#include "daemon/publishing/identity.hpp"
#include "daemon/publishing/recent_counts.hpp"
#include "daemon/publishing/wire_mesh.hpp"
#include "daemon/publishing/wire_model.hpp"
#include "daemon/publishing/wire_status.hpp"
#include "daemon/publishing/wire_surface.hpp"
#include "daemon/runtime/thread_launcher.hpp"
#include "daemon/runtime/tool_teller.hpp"

namespace perimap {

class Pipeline;
class Publication;

struct RuntimeSettings {
  Identity identity;
  SchedulingSettings scheduling;
  bool lock_memory = true;
  Duration phase_interval = std::chrono::milliseconds(100);
  Duration model_interval = std::chrono::milliseconds(500);
  Duration status_interval = std::chrono::seconds(1);
  Duration stalled_after = std::chrono::milliseconds(500);
  std::vector<WatchedTool> tools;       // whose distance from the surface is told
  std::int64_t keys_expire_utc_ns = 0;  // of DDS Security; 0: there are none
};

inline constexpr Duration kLongestPublisherRound = std::chrono::milliseconds(100);

// Threads: mapper, workers, publisher (real-time when permitted), finder, starter, surface, setup-watch, scope and
// tools where they are asked for, status. Sources are launched by their owner, with threads(), and push into
// pipeline.entrance().
class LiveRuntime {
 public:
  // `pipeline` and `publication` must outlive it. `on_status_tick` is called by the status thread every
  // phase_interval, for work that must not be done on the publisher thread.
  LiveRuntime(Pipeline& pipeline, const RuntimeSettings& settings, Publication& publication,
              std::function<void()> on_status_tick = {});
  LiveRuntime(const LiveRuntime&) = delete;
  LiveRuntime& operator=(const LiveRuntime&) = delete;
  ~LiveRuntime() { stop(); }

  // Before start(): called by the status thread for what it does not know itself.
  void describe_sources_by(std::function<void(StatusFacts&)> describe) { describe_sources_ = std::move(describe); }
  void start();
  // For sources and others that are not the runtime's own. Joined before this ends.
  [[nodiscard]] ThreadLauncher& threads() noexcept { return threads_; }

  // Takes what the tracker tells of other tools; null where none is told of.
  [[nodiscard]] ToolTeller* tools() noexcept { return tools_.get(); }

  // Tells that no more frames will come: the surfaces of those that came are still released.
  void end_of_sources() noexcept;
  // After end_of_sources(): the last surface has been released.
  [[nodiscard]] bool all_released() const noexcept { return all_released_.load(std::memory_order_relaxed); }

  // Raised by the publisher each time round its loop, at least every kLongestPublisherRound, whether or not frames
  // come; by nothing else. It stands still when that thread hangs.
  [[nodiscard]] std::uint64_t publisher_beats() const noexcept { return publisher_beats_.get(); }

  // Ends and joins every thread. Called twice it does nothing.
  void stop();

  // What the status tells beside the counters and the sources. Any thread but the real-time ones.
  [[nodiscard]] StatusFacts facts() const;

 private:
  // Of heart, breath and set-up, as the status thread found them last: the pipeline's cells have one reader.
  struct Beliefs {
    PhaseState phase = PhaseState::kUnknown;
    Rhythm rhythm = Rhythm::kUnknown;
    RespirationState respiration = RespirationState::kOff;
    bool respiration_suspected = false;
    RespirationSource respiration_source = RespirationSource::kNone;
    SetupBelief setup;
  };

  void run_mapper() noexcept;
  void run_publisher();
  void run_status();

  Pipeline& pipeline_;
  RuntimeSettings settings_;
  ThreadLauncher threads_;
  Publication& publication_;
  std::function<void()> on_status_tick_;
  std::function<void(StatusFacts&)> describe_sources_;
  std::vector<WireSurface> wire_surfaces_;  // by ReleaseStream
  WireModel wire_model_;
  WireMesh wire_mesh_;
  WirePhase wire_phase_;
  std::vector<WireStatus> wire_statuses_;  // of the streams that are published
  std::unique_ptr<ToolTeller> tools_;      // null where no tool is told of
  RecentCounts recent_;
  mutable std::mutex beliefs_mutex_;
  Beliefs beliefs_;
  Wakeup status_wakeup_;
  std::vector<std::thread> workers_;
  std::vector<std::thread> housekeepers_;
  std::thread mapper_;
  std::thread publisher_;
  std::thread status_;
  bool started_ = false;
  Counter publisher_beats_;
  perimap_Privilege memory_locked_ = perimap_PRIVILEGE_NOT_REQUESTED;
  // Relaxed throughout: each flag is a message by itself; the posts of the wake-ups that follow order what matters.
  std::atomic<bool> stopping_{false};
  std::atomic<bool> sources_ended_{false};
  std::atomic<bool> all_released_{false};
};

}  // namespace perimap

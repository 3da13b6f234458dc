// The pipeline over a recording in virtual time: as fast as it goes, and the same samples every time.
#pragma once

#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

#include "core/pipeline/frame_pool.hpp"
#include "daemon/publishing/identity.hpp"
#include "daemon/publishing/wire_mesh.hpp"
#include "daemon/publishing/wire_model.hpp"
#include "daemon/publishing/wire_status.hpp"
#include "daemon/publishing/wire_surface.hpp"
#include "daemon/runtime/tool_teller.hpp"
#include "drivers/recording/replay_reader.hpp"

namespace perimap {

class Pipeline;
class Publication;

// Events are delivered at their recorded arrival times and nothing is known before; deadlines fall at their virtual
// instants; computing takes no virtual time. Workers and housekeeping are real threads, waited for where the live
// pipeline would go on. Needs a pipeline with settings().lockstep. Used by one thread.
class LockstepRuntime {
 public:
  // `tools`: whose distance from the surface is told.
  LockstepRuntime(Pipeline& pipeline, const Identity& identity, Duration utc_minus_monotonic, Publication& publication,
                  const std::vector<WatchedTool>& tools = {});
  LockstepRuntime(const LockstepRuntime&) = delete;
  LockstepRuntime& operator=(const LockstepRuntime&) = delete;
  ~LockstepRuntime();

  // In order of arrival.
  void deliver(const ReplayEvent& event);

  // Gaps of the recording that were longer than kLongestReplayedGap, and the releases that were passed over in them.
  [[nodiscard]] std::uint64_t gaps() const noexcept { return gaps_; }
  [[nodiscard]] std::uint64_t releases_passed_over() const noexcept { return releases_passed_over_; }

  // After the last event: the releases that are still owed, then the final model and status.
  void finish();

 private:
  void advance_to(Instant t);
  void pass_over_gap(Instant until);
  void map_ready_frame();
  void release();
  void publish_reports(Instant now);

  Pipeline& pipeline_;
  Duration utc_minus_monotonic_;
  Publication& publication_;
  std::vector<WireSurface> wire_surfaces_;  // by ReleaseStream
  WireModel wire_model_;
  WireMesh wire_mesh_;
  WirePhase wire_phase_;
  std::vector<WireStatus> wire_statuses_;  // of the streams that are published
  std::unique_ptr<ToolTeller> tools_;      // null where no tool is told of
  std::vector<std::thread> threads_;
  bool frame_waits_ = false;
  FrameHandle frame_;
  Instant now_;
  Instant next_reports_;
  bool delivered_any_ = false;
  std::uint64_t gaps_ = 0;
  std::uint64_t releases_passed_over_ = 0;
};

}  // namespace perimap

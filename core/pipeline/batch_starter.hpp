// Housekeeping: solves the batch starts that workers ask for, on a thread of its own.
#pragma once

#include <atomic>
#include <memory>
#include <span>
#include <vector>

#include "core/estimation/measurement_model.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/surface_maker.hpp"
#include "core/realtime/spsc_ring.hpp"
#include "core/realtime/wakeup.hpp"

namespace perimap {

// request() is called by worker `worker` alone (a ring each), serve() by the housekeeping thread, wait_until_done() by
// the mapper while no worker runs.
class BatchStarter {
 public:
  // All but the settings must outlive it.
  BatchStarter(const PipelineSettings& settings, std::span<FeatureSlot> slots, SurfaceMaker& surfaces);

  // Never refused: the rings hold every slot, and a slot has at most one request under way.
  void request(int worker, int slot) noexcept;

  // Until dismiss().
  void serve() noexcept;
  void dismiss() noexcept;

  // Lockstep: returns when every request made so far is solved.
  void wait_until_done() noexcept;

 private:
  void solve(FeatureSlot& slot) noexcept;
  void start_on_newest_surface(BatchStartExchange& start, std::span<const Observation> observations);
  void begin_slow_error(FeatureSlot& slot) const noexcept;

  PixelModel model_;
  BasisLayout layout_;
  Prior prior_;
  BatchSettings batch_;
  std::span<FeatureSlot> slots_;
  SurfaceMaker& surfaces_;
  std::size_t trial_stride_;  // of slots, with whose starts the laws are tried
  struct Lane {
    explicit Lane(std::size_t capacity) : ring(capacity) {}
    SpscRing<int> ring;
    std::uint64_t requested = 0;  // the worker's own; the mapper reads it after joining the workers
  };
  std::vector<std::unique_ptr<Lane>> lanes_;
  Wakeup go_;
  Wakeup solved_;
  std::uint64_t waited_for_ = 0;  // the mapper's own
  // Relaxed throughout: the flag alone is the message, and the post of go_ that follows orders it.
  std::atomic<bool> dismissed_{false};
};

}  // namespace perimap

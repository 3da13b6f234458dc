// Tells with each surface how far the tracked tools' tips are from it.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <vector>

#include "core/realtime/spsc_ring.hpp"
#include "core/realtime/triple_buffer.hpp"
#include "core/realtime/wakeup.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "core/time/instant.hpp"
#include "core/tool/tool_distance.hpp"
#include "daemon/publishing/identity.hpp"
#include "daemon/publishing/wire_tool.hpp"

namespace perimap {

class Pipeline;
class Publication;
struct SurfaceSample;

// Live it has a thread of its own, which the publisher wakes when it has written a surface: a mesh has thousands of
// triangles, and the next surface must not wait for them. In virtual time the one thread calls tell().
class ToolTeller {
 public:
  // `pipeline` and `publication` must outlive it.
  ToolTeller(Pipeline& pipeline, const Identity& identity, const std::vector<WatchedTool>& tools,
             Publication& publication);

  // Tracker thread. It neither blocks nor allocates; what does not fit is left out.
  void push(const ToolSample& sample) noexcept { static_cast<void>(samples_.push(sample)); }

  // Publisher thread, after the surface was composed and sent. It neither blocks nor allocates. Where two come before
  // the thread has looked, the later one alone is told.
  void sent(const SurfaceSample& surface) noexcept;

  // Until dismiss().
  void serve();
  void dismiss() noexcept;

  // In virtual time, after the surface was composed and sent.
  void tell(const SurfaceSample& surface, Duration utc_minus_monotonic);

 private:
  [[nodiscard]] bool is_of_first_stream(const SurfaceSample& surface) const noexcept;
  void fill(const SurfaceSample& surface, SurfaceRelease& release) const noexcept;
  void drain() noexcept;
  void tell(const SurfaceRelease& release, Duration utc_minus_monotonic);

  Pipeline& pipeline_;
  Publication& publication_;
  ToolDistances distances_;
  std::vector<WireTool> wires_;  // by tool
  SurfaceRelease release_;       // in virtual time
  SpscRing<ToolSample> samples_;
  TripleBuffer<SurfaceRelease> releases_;
  Wakeup wakeup_;
  // Relaxed: a message by itself; the post that follows it orders it.
  std::atomic<bool> dismissed_{false};
};

// Null where there is no tool to tell of.
[[nodiscard]] std::unique_ptr<ToolTeller> tool_teller(Pipeline& pipeline, const Identity& identity,
                                                      const std::vector<WatchedTool>& tools, Publication& publication);

}  // namespace perimap

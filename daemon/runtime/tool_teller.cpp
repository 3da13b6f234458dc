#include "daemon/runtime/tool_teller.hpp"

#include <chrono>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/surface_maker.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "core/realtime/realtime_scope.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/utc_offset.hpp"

namespace perimap {
namespace {

constexpr std::size_t kUsualVertices = 1024;  // of a mesh; a larger one takes its memory once
// Eight tools at a kilohertz between two looks.
constexpr std::size_t kSamples = 1024;
// Readings are taken at least so often, whether or not surfaces are released.
constexpr Duration kLongestSleep = std::chrono::milliseconds(100);

}  // namespace

ToolTeller::ToolTeller(Pipeline& pipeline, const Identity& identity, const std::vector<WatchedTool>& tools,
                       Publication& publication)
    : pipeline_(pipeline),
      publication_(publication),
      distances_(tools, pipeline.settings().pose, kUsualVertices),
      samples_(kSamples) {
  for (const WatchedTool& tool : tools) wires_.emplace_back(identity, tool.name);
}

bool ToolTeller::is_of_first_stream(const SurfaceSample& surface) const noexcept {
  return surface.release.stream == first_stream(pipeline_.settings());
}

void ToolTeller::fill(const SurfaceSample& surface, SurfaceRelease& release) const noexcept {
  release.sample_sequence = surface.sample_sequence;
  release.release_time = surface.release.deadline;
  release.valid_time = surface.valid_time;
  release.valid_until = surface.valid_until;
  release.state = surface.state;
  release.reason = surface.reason;
  release.heart = pipeline_.composed_heart();
  release.breath = pipeline_.composed_breath();
}

void ToolTeller::sent(const SurfaceSample& surface) noexcept {
  const RealtimeScope realtime;
  if (!is_of_first_stream(surface)) return;
  fill(surface, releases_.back());
  releases_.publish();
  wakeup_.post();
}

void ToolTeller::drain() noexcept {
  ToolSample sample;
  while (samples_.pop(sample)) distances_.add(sample);
}

void ToolTeller::serve() {
  while (!dismissed_.load(std::memory_order_relaxed)) {
    static_cast<void>(wakeup_.wait_until(MonotonicClock::now() + kLongestSleep));
    drain();
    if (releases_.update()) tell(releases_.front(), utc_minus_monotonic());
  }
}

void ToolTeller::dismiss() noexcept {
  dismissed_.store(true, std::memory_order_relaxed);
  wakeup_.post();
}

void ToolTeller::tell(const SurfaceSample& surface, Duration utc_minus_monotonic) {
  if (!is_of_first_stream(surface)) return;
  drain();
  fill(surface, release_);
  tell(release_, utc_minus_monotonic);
}

void ToolTeller::tell(const SurfaceRelease& release, Duration utc_minus_monotonic) {
  const auto told = distances_.at(release, pipeline_.surface_maker().newest());
  for (std::size_t i = 0; i < told.size(); ++i) {
    publication_.tool(wires_[i].fill(told[i], release, utc_minus_monotonic));
  }
}

std::unique_ptr<ToolTeller> tool_teller(Pipeline& pipeline, const Identity& identity,
                                        const std::vector<WatchedTool>& tools, Publication& publication) {
  if (tools.empty()) return nullptr;
  return std::make_unique<ToolTeller>(pipeline, identity, tools, publication);
}

}  // namespace perimap

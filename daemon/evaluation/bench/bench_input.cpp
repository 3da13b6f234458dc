#include "daemon/evaluation/bench/bench_input.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

#include "drivers/recording/cdr.hpp"

namespace perimap::bench {

SetupExpected<ReplaySetup> prepare_run(const BenchInput& input, int features, int workers) {
  auto setup = prepare_replay(input.recording, input.configuration, ReadMode::kStrict);
  if (!setup) return setup;
  PipelineSettings& pipeline = setup->pipeline;
  const double pixels = static_cast<double>(pipeline.camera.width) * pipeline.camera.height;
  pipeline.features.maximum = features;
  pipeline.features.minimum_distance_px =
      std::clamp(std::sqrt(pixels / (2.0 * features)), 1.0, pipeline.features.minimum_distance_px);
  pipeline.workers = workers;
  pipeline.shedding = false;  // what is asked for is what is measured
  setup->identity.source = "perimap-bench";
  return std::move(*setup);
}

ReplayEdit paced(int every_frame, double speed, Duration length) {
  return [every_frame, speed, length, first = std::optional<Instant>()](ReplayEvent& event) mutable {
    if (!first) first = arrival_of(event);
    speed_up(event, *first, speed);
    if (arrival_of(event) - *first > length) return ReplayStep::kEnd;
    if (auto* frame = std::get_if<FrameEvent>(&event)) {
      const auto n = static_cast<std::uint64_t>(every_frame);
      if (frame->stamp.sequence % n != 0) return ReplayStep::kSkip;
      frame->stamp.sequence /= n;
    }
    return ReplayStep::kDeliver;
  };
}

Expected<std::size_t> surface_bytes(std::size_t features) {
  std::vector<perimap_SurfaceFeature> values(features);
  perimap_Surface surface{};
  const auto n = static_cast<std::uint32_t>(features);
  surface.features = {n, n, values.data(), false};
  CdrSerializer serializer;
  return serializer.serialize(surface).map([](std::span<const std::byte> bytes) { return bytes.size(); });
}

}  // namespace perimap::bench

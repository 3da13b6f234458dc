#include "daemon/config/surface_traffic.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace perimap {

SurfaceTraffic surface_traffic(const Configuration& configuration) noexcept {
  using Release = PipelineConfiguration::Release;
  const Release release = configuration.pipeline.release;
  SurfaceTraffic traffic;
  traffic.surface_bytes =
      kSurfaceBytes + kSurfaceFeatureBytes * static_cast<std::size_t>(configuration.features.maximum);
  if (release != Release::kClock) {
    const double given_hz = configuration.camera.frame_rate_hz;
    traffic.frame_rate_hz = given_hz > 0.0 ? given_hz : kUsualFrameRate_hz;
  }
  if (release != Release::kFrame) traffic.clock_rate_hz = configuration.pipeline.clock_rate_hz;
  return traffic;
}

std::vector<std::string> traffic_lines(const Configuration& configuration) {
  const SurfaceTraffic traffic = surface_traffic(configuration);
  std::vector<std::string> lines;
  if (traffic.frame_rate_hz > 0.0) {
    const bool given = configuration.camera.frame_rate_hz > 0.0;
    lines.push_back(
        fmt::format("stream \"frame\": a surface for each frame, {:.6g} ms after its capture; at {:.6g} frames/s{} "
                    "at most {:.3g} MB/s",
                    to_seconds(configuration.pipeline.latency) * 1e3, traffic.frame_rate_hz,
                    given ? "" : " (no rate is given)", traffic.frame_MB_per_s()));
  }
  if (traffic.clock_rate_hz > 0.0) {
    lines.push_back(
        fmt::format("stream \"clock\": {:.6g} surfaces/s, at the multiples of {} ns of the monotonic clock; at "
                    "most {:.3g} MB/s",
                    traffic.clock_rate_hz, clock_period(configuration.pipeline).count(), traffic.clock_MB_per_s()));
  }
  lines.push_back(fmt::format("surfaces of at most {} bytes, together at most {:.3g} of {:.6g} MB/s",
                              traffic.surface_bytes, traffic.MB_per_s(), configuration.dds.maximum_MB_per_s));
  return lines;
}

double highest_clock_rate_hz(const Configuration& configuration) noexcept {
  const SurfaceTraffic traffic = surface_traffic(configuration);
  const double surfaces = configuration.dds.maximum_MB_per_s * 1e6 / static_cast<double>(traffic.surface_bytes);
  // Rounded down to what is written, so that what an error names is accepted.
  return std::floor((surfaces - traffic.frame_rate_hz) * 100.0) / 100.0;
}

int most_features(const Configuration& configuration) noexcept {
  const SurfaceTraffic traffic = surface_traffic(configuration);
  const double bytes = configuration.dds.maximum_MB_per_s * 1e6 / (traffic.frame_rate_hz + traffic.clock_rate_hz);
  const double features = (bytes - static_cast<double>(kSurfaceBytes)) / static_cast<double>(kSurfaceFeatureBytes);
  return std::max(0, static_cast<int>(std::floor(features)));
}

}  // namespace perimap

#include "daemon/config/surface_traffic.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/periodic/basis.hpp"
#include "core/phase/respiration_search.hpp"

namespace perimap {
namespace {

std::size_t model_feature_bytes(const Configuration& configuration) noexcept {
  BasisLayout layout;
  layout.cardiac_harmonics = configuration.estimation.harmonics;
  if (configuration.respiration.enabled) layout.respiratory_harmonics = kBreathHarmonics;
  return kModelFeatureBytes + kModelCoefficientBytes * static_cast<std::size_t>(layout.state_size());
}

}  // namespace

SurfaceTraffic surface_traffic(const Configuration& configuration) noexcept {
  using Release = PipelineConfiguration::Release;
  const Release release = configuration.pipeline.release;
  SurfaceTraffic traffic;
  const auto features = static_cast<std::size_t>(configuration.features.maximum);
  traffic.surface_bytes = kSurfaceBytes + kSurfaceFeatureBytes * features;
  traffic.model_bytes = kModelBytes + model_feature_bytes(configuration) * features;
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
  lines.push_back(fmt::format(
      "a surface model at each beat and every {:.6g} ms, of at most {} bytes: at most {:.3g} MB/s",
      to_seconds(configuration.dds.surface_model_interval) * 1e3, traffic.model_bytes, traffic.model_MB_per_s()));
  lines.push_back(fmt::format("surfaces of at most {} bytes; all together at most {:.3g} of {:.6g} MB/s to one reader",
                              traffic.surface_bytes, traffic.MB_per_s(), configuration.dds.maximum_MB_per_s));
  return lines;
}

double highest_clock_rate_hz(const Configuration& configuration) noexcept {
  const SurfaceTraffic traffic = surface_traffic(configuration);
  const double left_MB_per_s = configuration.dds.maximum_MB_per_s - traffic.model_MB_per_s();
  const double surfaces = left_MB_per_s * 1e6 / static_cast<double>(traffic.surface_bytes);
  // Rounded down to what is written, so that what an error names is accepted.
  return std::floor((surfaces - traffic.frame_rate_hz) * 100.0) / 100.0;
}

int most_features(const Configuration& configuration) noexcept {
  const SurfaceTraffic traffic = surface_traffic(configuration);
  const double surfaces_hz = traffic.frame_rate_hz + traffic.clock_rate_hz;
  const double models_hz = 1.0 / to_seconds(kModelsApart);
  const double without =
      surfaces_hz * static_cast<double>(kSurfaceBytes) + models_hz * static_cast<double>(kModelBytes);
  const double each = surfaces_hz * static_cast<double>(kSurfaceFeatureBytes) +
                      models_hz * static_cast<double>(model_feature_bytes(configuration));
  const double features = (configuration.dds.maximum_MB_per_s * 1e6 - without) / each;
  return std::max(0, static_cast<int>(std::floor(features)));
}

}  // namespace perimap

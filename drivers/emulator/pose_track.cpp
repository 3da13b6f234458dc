#include "drivers/emulator/pose_track.hpp"

#include <cmath>
#include <numbers>

namespace perimap {

PoseTrack PoseTrack::of_samples(Instant start, const std::vector<TrackerSample>& samples) {
  std::vector<ToolReading> readings;
  readings.reserve(samples.size());
  for (const TrackerSample& sample : samples) readings.push_back({sample.state, sample.X_WS});
  double rate_hz = 100.0;
  if (samples.size() > 1) {
    rate_hz =
        static_cast<double>(samples.size() - 1) / to_seconds(samples.back().source_time - samples.front().source_time);
  }
  return {start, rate_hz, std::move(readings)};
}

PoseTrack PoseTrack::swaying(Instant start, double rate_hz) {
  constexpr double kSeconds = 3600.0;
  constexpr double kPeriod_s = 4.0;
  std::vector<ToolReading> readings;
  const auto count = static_cast<std::size_t>(kSeconds * rate_hz);
  readings.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double phase = 2.0 * std::numbers::pi * static_cast<double>(i) / rate_hz / kPeriod_s;
    const Pose X_TO{so3_exp(Vector3d(0.1 * std::sin(phase), 0.05 * std::cos(phase), 0.0)),
                    Vector3d(20.0 * std::cos(phase), 20.0 * std::sin(phase), -500.0)};
    readings.push_back({ToolState::kOk, X_TO});
  }
  return {start, rate_hz, std::move(readings)};
}

}  // namespace perimap

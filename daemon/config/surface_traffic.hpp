// How much a configuration would publish.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "daemon/config/configuration.hpp"

namespace perimap {

// A surface as it goes over the wire (XCDR2, names of full length): the surface itself, and each feature of it. A test
// holds them against the serialiser.
inline constexpr std::size_t kSurfaceBytes = 480;
inline constexpr std::size_t kSurfaceFeatureBytes = 124;
// What the frames' stream is reckoned at where the configuration does not say how many frames there are.
inline constexpr double kUsualFrameRate_hz = 60.0;

// Of surfaces with all the features that may be followed, without what the network adds.
struct SurfaceTraffic {
  std::size_t surface_bytes = 0;
  double frame_rate_hz = 0.0;  // of the frames' stream; 0: it is not published
  double clock_rate_hz = 0.0;  // of the clock's stream; 0: it is not published

  [[nodiscard]] double frame_MB_per_s() const noexcept { return frame_rate_hz * mega_bytes(); }
  [[nodiscard]] double clock_MB_per_s() const noexcept { return clock_rate_hz * mega_bytes(); }
  [[nodiscard]] double MB_per_s() const noexcept { return frame_MB_per_s() + clock_MB_per_s(); }

 private:
  [[nodiscard]] double mega_bytes() const noexcept { return static_cast<double>(surface_bytes) * 1e-6; }
};

[[nodiscard]] SurfaceTraffic surface_traffic(const Configuration& configuration) noexcept;

// A line for each stream that is published, and one for all of them.
[[nodiscard]] std::vector<std::string> traffic_lines(const Configuration& configuration);

// What would fit under dds.maximum_MB_per_s, all else being as it is: the clock's rate (it may be negative), and
// features.maximum (0: not even an empty surface does).
[[nodiscard]] double highest_clock_rate_hz(const Configuration& configuration) noexcept;
[[nodiscard]] int most_features(const Configuration& configuration) noexcept;

}  // namespace perimap

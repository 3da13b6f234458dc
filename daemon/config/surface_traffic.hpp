// How much a configuration would publish.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include "core/time/instant.hpp"
#include "daemon/config/configuration.hpp"

namespace perimap {

// A surface as it goes over the wire (XCDR2, names of full length): the surface itself, and each feature of it. A test
// holds them against the serialiser.
inline constexpr std::size_t kSurfaceBytes = 560;
inline constexpr std::size_t kSurfaceFeatureBytes = 124;
// Likewise a surface model (with the cycles of half a minute), each feature of it, and each coefficient of an axis.
inline constexpr std::size_t kModelBytes = 4096;
inline constexpr std::size_t kModelFeatureBytes = 64;
inline constexpr std::size_t kModelCoefficientBytes = 8;
// From one model to the next at the least: each beat and each change of the surface's state makes one.
inline constexpr Duration kModelsApart = std::chrono::milliseconds(100);
// What the frames' stream is reckoned at where the configuration does not say how many frames there are.
inline constexpr double kUsualFrameRate_hz = 60.0;

// Of surfaces and surface models with all the features that may be followed, to one reader: without what the network
// adds, and without what is sent again. By multicast any number of readers cost no more; each that is reached by
// unicast costs as much again.
struct SurfaceTraffic {
  std::size_t surface_bytes = 0;
  std::size_t model_bytes = 0;
  double frame_rate_hz = 0.0;  // of the frames' stream; 0: it is not published
  double clock_rate_hz = 0.0;  // of the clock's stream; 0: it is not published

  [[nodiscard]] double frame_MB_per_s() const noexcept { return frame_rate_hz * mega_bytes(); }
  [[nodiscard]] double clock_MB_per_s() const noexcept { return clock_rate_hz * mega_bytes(); }
  [[nodiscard]] double model_MB_per_s() const noexcept {
    return static_cast<double>(model_bytes) * 1e-6 / to_seconds(kModelsApart);
  }
  [[nodiscard]] double MB_per_s() const noexcept { return frame_MB_per_s() + clock_MB_per_s() + model_MB_per_s(); }

 private:
  [[nodiscard]] double mega_bytes() const noexcept { return static_cast<double>(surface_bytes) * 1e-6; }
};

[[nodiscard]] SurfaceTraffic surface_traffic(const Configuration& configuration) noexcept;

// A line for each stream that is published, one for the models, and one for all of them.
[[nodiscard]] std::vector<std::string> traffic_lines(const Configuration& configuration);

// What would fit under dds.maximum_MB_per_s, all else being as it is: the clock's rate (it may be negative), and
// features.maximum (0: not even an empty surface does).
[[nodiscard]] double highest_clock_rate_hz(const Configuration& configuration) noexcept;
[[nodiscard]] int most_features(const Configuration& configuration) noexcept;

}  // namespace perimap

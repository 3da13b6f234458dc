// Windows of matches as a scope has them that sways over a beating surface, with set-ups that are wrong by a stated
// amount, and with the errors that real ones have.
#pragma once

#include <cstdint>

#include "core/geometry/camera_model.hpp"
#include "core/periodic/basis.hpp"
#include "core/setup_watch/watched_window.hpp"

namespace perimap::watched_scene {

struct Scene {
  // What has to be added to the configured set-up to come to the true one.
  SetupVector deviation = SetupVector::Zero();
  int features = 12;
  int harmonics = 3;
  double seconds = 20.0;
  double frames_per_s = 10.0;
  double sway = 1.0;  // of 33 x 25 x 12 mm at 90 mm, with 10 degrees of roll; 0: the scope rests
  double pixel_deviation_px = 0.7;
  // True errors of the tracker, per axis; and what is told of them.
  double position_deviation_mm = 1.4;
  double rotation_deviation_rad = 0.0087;
  double error_correlation_s = 0.0;
  bool correlation_told = true;
  double outliers = 0.0;  // share of the matches that are 30 px off
};

[[nodiscard]] CameraModel camera();
[[nodiscard]] BasisLayout layout(const Scene& scene);

// The same seed and scene give the same window.
[[nodiscard]] WatchedWindow watch(const Scene& scene, std::uint32_t seed);

}  // namespace perimap::watched_scene

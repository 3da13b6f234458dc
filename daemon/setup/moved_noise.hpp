// A tracker's noise at rest, and while its sensor is moved: an error that goes with the place stands still with the
// sensor, and shows only then.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/tracker_noise.hpp"
#include "core/error/expected.hpp"
#include "daemon/pages/svg_plot.hpp"
#include "daemon/setup/hand_eye.hpp"

namespace perimap {

// By what hand-eye and board leave over of each pose in which the camera saw the board: the tracker's errors, and a
// little of the camera's. Those that are new in each pose are lessened, for a pose at the picture's instant lies
// between two readings. Fails as measure_tracker_noise() does.
[[nodiscard]] Expected<MeasuredNoise> noise_while_moved(const HandEyeCalibration& hand_eye);

struct TrackerErrors {
  MeasuredNoise still;
  std::optional<MeasuredNoise> moved;

  // What perimapd is to be told: the larger of both in position and in rotation; as long lasting as while it was moved
  // where that is larger by more than a measured noise may be off.
  [[nodiscard]] double position_deviation_mm() const;
  [[nodiscard]] double rotation_deviation_deg() const;
  [[nodiscard]] double correlation_s() const;
  [[nodiscard]] bool larger_while_moved() const;
};

[[nodiscard]] std::string text_of(const TrackerErrors& errors);
// The figures that perimapd is to be told with those keys; as measured at rest and while moved below "still", "moved".
[[nodiscard]] nlohmann::json json_of(const TrackerErrors& errors);
[[nodiscard]] std::vector<Plot> plots_of(const TrackerErrors& errors);

}  // namespace perimap

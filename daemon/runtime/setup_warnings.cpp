#include "daemon/runtime/setup_warnings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <utility>

#include "core/angle/angle.hpp"
#include "daemon/runtime/calibration_fit.hpp"
#include "drivers/calibration/calibration_file.hpp"

namespace perimap {
namespace {

// `has_scope`: a turned scope has the hand-eye.
void warn_of_tracker(const TrackerConfiguration& tracker, bool has_scope, std::vector<std::string>& warnings) {
  if (tracker.protocol == TrackerConfiguration::Protocol::kNone) return;
  const TrackerConfiguration untold;
  if (!has_scope &&
      std::equal(std::begin(tracker.translation_SC_mm), std::end(tracker.translation_SC_mm),
                 untold.translation_SC_mm) &&
      std::equal(std::begin(tracker.rotation_SC_wxyz), std::end(tracker.rotation_SC_wxyz), untold.rotation_SC_wxyz)) {
    warnings.emplace_back(
        "tracker.hand_eye_translation_SC_mm, tracker.hand_eye_rotation_SC_wxyz: the camera is said to be the tracked "
        "sensor itself; measure where it is with `perimap calibrate hand-eye`");
  }
  if (tracker.position_deviation_mm == 0.0 || tracker.rotation_deviation_rad == 0.0) {
    warnings.emplace_back(
        "tracker.position_deviation_mm, tracker.rotation_deviation_deg: the tracker is said to be exact, which no real "
        "one is; nothing converges then, or too much is believed; measure its noise with `perimap calibrate tracker`");
  }
}

void warn_of_repeats(const Configuration& configuration, std::vector<std::string>& warnings) {
  if (configuration.camera.device && configuration.camera.repeats_allowed) {
    warnings.emplace_back(
        "camera.repeats_allowed: a camera that has hung and gives its memory is not noticed; for trials alone");
  }
  if (configuration.ecg.protocol != EcgConfiguration::Protocol::kNone && configuration.ecg.repeats_allowed) {
    warnings.emplace_back(
        "ecg.repeats_allowed: an ECG device that has hung and gives its memory is not noticed; for trials alone");
  }
}

void warn_of_lens(const CameraModel& c, std::vector<std::string>& warnings) {
  // By more than a fifth of the picture from its middle.
  const double right = (c.cx - 0.5 * (c.width - 1)) / c.width;
  const double down = (c.cy - 0.5 * (c.height - 1)) / c.height;
  if (std::max(std::abs(right), std::abs(down)) > 0.2) {
    warnings.push_back(
        fmt::format("camera.calibration: the principal point {:.0f} {:.0f} is {:.0f} % of the picture's size from its "
                    "middle; is the "
                    "calibration of pictures of another size? Measure it with `perimap calibrate camera`",
                    c.cx, c.cy, 100.0 * std::max(std::abs(right), std::abs(down))));
  }
  const bool without = c.k1 == 0.0 && c.k2 == 0.0 && c.p1 == 0.0 && c.p2 == 0.0 && c.k3 == 0.0 && c.k4 == 0.0;
  const double across = 2.0 * std::atan(0.5 * std::hypot(c.width, c.height) / std::min(c.fx, c.fy)) / kDegree;
  constexpr double kWide_deg = 60.0;
  if (c.lens == Lens::kBrownConrady && without && across > kWide_deg) {
    warnings.push_back(fmt::format(
        "camera.calibration: no distortion at all with a lens of {:.0f} degrees from corner to corner; measure it with "
        "`perimap calibrate camera`",
        across));
  }
}

}  // namespace

std::vector<std::string> setup_warnings(const Configuration& configuration, const std::optional<CameraModel>& camera) {
  std::vector<std::string> warnings;
  if (configuration.replay.recording) return warnings;
  warn_of_tracker(configuration.tracker, configuration.camera.turned_scope.has_value(), warnings);
  warn_of_repeats(configuration, warnings);
  if (camera) warn_of_lens(*camera, warnings);
  return warnings;
}

std::vector<std::string> setup_warnings(const Configuration& configuration) {
  std::optional<CameraModel> camera;
  if (configuration.camera.calibration) {
    if (auto read = read_calibration(*configuration.camera.calibration)) camera = *read;
  }
  std::vector<std::string> warnings = setup_warnings(configuration, camera);
  if (configuration.replay.recording) return warnings;
  for (std::string& old : old_calibrations(configuration, std::chrono::system_clock::now())) {
    warnings.push_back(std::move(old));
  }
  return warnings;
}

}  // namespace perimap

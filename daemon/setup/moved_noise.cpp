#include "daemon/setup/moved_noise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <utility>

#include "daemon/setup/setup_plots.hpp"
#include "daemon/setup/setup_report.hpp"

namespace perimap {

Expected<MeasuredNoise> noise_while_moved(const HandEyeCalibration& hand_eye) {
  const Pose X_CS = hand_eye.X_SC.inverse();
  std::vector<TimedPose> errors;
  for (std::size_t i = 0; i < hand_eye.pairs.size(); ++i) {
    if (hand_eye.used[i] == 0) continue;
    const PosePair& pair = hand_eye.pairs[i];
    const Pose seen = hand_eye.X_WB * pair.X_BC * X_CS;  // X_WS by the camera
    errors.push_back({pair.t_s, Pose{seen.R.transpose() * pair.X_WS.R, pair.X_WS.t - seen.t}});
  }
  return measure_tracker_noise(errors);
}

bool TrackerErrors::larger_while_moved() const {
  constexpr double kMayBeOff = 1.15;
  return moved && (moved->position_deviation_mm > kMayBeOff * still.position_deviation_mm ||
                   moved->rotation_deviation_deg > kMayBeOff * still.rotation_deviation_deg);
}

double TrackerErrors::position_deviation_mm() const {
  return larger_while_moved() ? std::max(still.position_deviation_mm, moved->position_deviation_mm)
                              : still.position_deviation_mm;
}

double TrackerErrors::rotation_deviation_deg() const {
  return larger_while_moved() ? std::max(still.rotation_deviation_deg, moved->rotation_deviation_deg)
                              : still.rotation_deviation_deg;
}

double TrackerErrors::correlation_s() const {
  return larger_while_moved() ? std::max(still.correlation_s, moved->correlation_s) : still.correlation_s;
}

std::string text_of(const TrackerErrors& errors) {
  std::string text = text_of(errors.still);
  if (!errors.moved) {
    return text +
           "  while it is moved       not measured: an error that goes with the place does not show at rest; --moved "
           "takes a recording of a board (perimap calibrate hand-eye --keep)\n";
  }
  const MeasuredNoise& moved = *errors.moved;
  text += fmt::format(
      "While it was moved, by {} pictures of the board over {:.0f} s: {:.3f} mm, {:.3f} degrees, of which {:.0f} % "
      "lasts for {:.3f} s\n",
      moved.poses, moved.still_s, moved.position_deviation_mm, moved.rotation_deviation_deg,
      100.0 * moved.lasting_share, moved.correlation_s);
  if (!errors.larger_while_moved()) return text + "  no more than at rest: the figures at rest hold\n";
  return text + fmt::format(
                    "  more than at rest: perimapd is told {:.3f} mm, {:.3f} degrees, {:.3f} s. The tracker errs "
                    "otherwise in other places: look for what bends its field, or is in its sight\n",
                    errors.position_deviation_mm(), errors.rotation_deviation_deg(), errors.correlation_s());
}

nlohmann::json json_of(const TrackerErrors& errors) {
  nlohmann::json json = json_of(errors.still);
  if (!errors.moved) return json;
  nlohmann::json moved = json_of(*errors.moved);
  // Of one that is not larger the figures are those at rest.
  if (errors.larger_while_moved()) {
    const auto take = [&](const char* key, bool of_moved) {
      const std::string deviation = fmt::format("{}_deviation", key);
      if (of_moved) json[key] = moved[key], json[deviation] = moved[deviation];
    };
    json["still"] = json_of(errors.still);
    take("position_deviation_mm", errors.moved->position_deviation_mm > errors.still.position_deviation_mm);
    take("rotation_deviation_deg", errors.moved->rotation_deviation_deg > errors.still.rotation_deviation_deg);
    take("error_correlation_s", errors.moved->correlation_s > errors.still.correlation_s);
  }
  json["larger_while_moved"] = errors.larger_while_moved();
  json["moved"] = std::move(moved);
  return json;
}

std::vector<Plot> plots_of(const TrackerErrors& errors) {
  std::vector<Plot> plots = plots_of(errors.still);
  if (!errors.moved) return plots;
  for (Plot& plot : plots_of(*errors.moved)) {
    plot.title += ", while it was moved";
    plots.push_back(std::move(plot));
  }
  return plots;
}

}  // namespace perimap

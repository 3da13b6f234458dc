#include "daemon/setup/commands/calibrate_hand_eye.hpp"

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/setup/commands/board_motion.hpp"
#include "daemon/setup/hand_eye.hpp"
#include "daemon/setup/recorded_date.hpp"
#include "daemon/setup/recorded_sensor.hpp"
#include "daemon/setup/setup_plots.hpp"
#include "daemon/setup/setup_report.hpp"
#include "drivers/pose_file/pose_table.hpp"

namespace perimap {
namespace {

struct HandEyeOptions {
  BoardMotionOptions motion;
  std::string camera;
  std::string tracker;
  HandEyeSettings settings;
};

SetupExpected<HandEyeCalibration> by_files(const HandEyeOptions& options) {
  if (options.camera.empty() || options.tracker.empty()) {
    return wrong_setup("expected --camera-poses and --tracker-poses, or a recording with --from");
  }
  const CommonOptions& common = options.motion.common;
  const auto camera = read_pose_table(options.camera, common.length_unit(), common.unit_of_times());
  if (!camera) return tl::unexpected(camera.error());
  const auto tracker = read_pose_table(options.tracker, common.length_unit(), common.unit_of_times());
  if (!tracker) return tl::unexpected(tracker.error());
  return calibrate_hand_eye(camera->poses, tracker->poses, options.settings);
}

// None where neither the recording nor the configuration says.
SetupExpected<std::optional<std::string>> sensor_of(const HandEyeOptions& options) {
  Configuration configuration;
  const std::string& file = options.motion.common.configuration;
  if (!file.empty()) {
    auto loaded = load_configuration(file, {}, NamedFiles::kMayBeMissing);
    if (!loaded) return wrong_setup(loaded.error());
    configuration = *std::move(loaded);
  }
  if (!options.motion.is_recorded()) return configuration.tracker.sensor;
  return calibrated_sensor(options.motion.recorded.recording, configuration, file);
}

SetupExpected<Measurement> measure(const HandEyeOptions& options, const Console& console) {
  const auto result =
      options.motion.is_recorded() ? hand_eye_of(options.motion, options.settings, console) : by_files(options);
  if (!result) return tl::unexpected(result.error());
  Measurement measured{text_of(*result), json_of(*result), {}};
  measured.keys = {{"hand_eye_translation_SC_mm", list_of(measured.json["translation_mm"])},
                   {"hand_eye_rotation_SC_wxyz", list_of(measured.json["rotation_wxyz"])}};
  // What check and perimapd look at: when it was measured, and of which sensor.
  measured.keys.push_back(
      {"hand_eye_date", fmt::format("{:?}", date_of_measurement(options.motion.recorded.recording))});
  const auto sensor = sensor_of(options);
  if (!sensor) return tl::unexpected(sensor.error());
  if (*sensor) measured.json["sensor"] = **sensor;
  // One of before would be said of this hand-eye.
  measured.keys.push_back({"hand_eye_sensor", *sensor ? fmt::format("{:?}", **sensor) : ""});
  measured.plots = plots_of(*result);
  if (result->offset_measured && result->is_brisk()) {
    measured.keys.push_back({"time_offset_ms", number_of(1e3 * result->offset_s)});
  }
  return measured;
}

}  // namespace

void add_calibrate_hand_eye(Commands& commands, Command& calibrate) {
  const auto options = std::make_shared<HandEyeOptions>();
  Command& command =
      commands.add(calibrate, "hand-eye",
                   "The camera's place in the tracked sensor, and the offset of the two clocks, from poses of both",
                   [options](const Console& console) {
                     return measure_motion(options->motion, {options->camera, options->tracker}, console,
                                           [&] { return measure(*options, console); });
                   });
  command.add_option("--camera-poses", options->camera, "The camera in the board's frame: t_s,x,y,z,qx,qy,qz,qw");
  command.add_option("--tracker-poses", options->tracker, "The sensor in the tracker's frame, likewise");
  add_board_motion(command, options->motion);
  command.add_option("--largest-offset-s", options->settings.largest_offset_s, "The clocks differ by no more")
      ->check(Range(0.0, 3600.0))
      ->capture_default_str();
  add_time_unit(command, options->motion.common);
  add_common(command, options->motion.common, true, true);
}

}  // namespace perimap

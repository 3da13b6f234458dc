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
#include "daemon/setup/commands/live_capture.hpp"
#include "daemon/setup/commands/measurement.hpp"
#include "daemon/setup/commands/recorded_options.hpp"
#include "daemon/setup/hand_eye.hpp"
#include "daemon/setup/kept_result.hpp"
#include "daemon/setup/live_guide.hpp"
#include "daemon/setup/recorded_poses.hpp"
#include "daemon/setup/recorded_sensor.hpp"
#include "daemon/setup/setup_plots.hpp"
#include "daemon/setup/setup_report.hpp"
#include "daemon/setup/signal_offset.hpp"
#include "drivers/pose_file/pose_table.hpp"

namespace perimap {
namespace {

struct HandEyeOptions {
  CommonOptions common;
  std::string camera;
  std::string tracker;
  RecordedOptions recorded;
  LiveOptions live;
  HandEyeSettings settings;

  [[nodiscard]] bool is_recorded() const { return !recorded.recording.empty(); }
  // All that is read, but the configuration, which may take the result.
  [[nodiscard]] std::vector<std::string> inputs() const {
    return {camera, tracker, recorded.recording, recorded.calibration};
  }
  [[nodiscard]] std::vector<std::string> files() const { return {camera, tracker}; }
};

SetupExpected<HandEyeCalibration> by_recording(const RecordedOptions& recorded, const CommonOptions& common,
                                               const HandEyeSettings& settings, const Console& console) {
  auto motion = motion_of(recorded, common.configuration, console);
  if (!motion) return tl::unexpected(motion.error());
  auto result = calibrate_hand_eye(std::move(motion->camera_poses), std::move(motion->sensor_poses), settings);
  if (!result) return fail(recorded.recording + ": " + result.error().message);
  return *std::move(result);
}

SetupExpected<HandEyeCalibration> by_files(const HandEyeOptions& options) {
  if (options.camera.empty() || options.tracker.empty()) {
    return wrong_setup("expected --camera-poses and --tracker-poses, or a recording with --from");
  }
  const auto camera = read_pose_table(options.camera, options.common.length_unit());
  if (!camera) return tl::unexpected(camera.error());
  const auto tracker = read_pose_table(options.tracker, options.common.length_unit());
  if (!tracker) return tl::unexpected(tracker.error());
  return calibrate_hand_eye(camera->poses, tracker->poses, options.settings);
}

// None where neither the recording nor the configuration says.
SetupExpected<std::optional<std::string>> sensor_of(const HandEyeOptions& options) {
  Configuration configuration;
  const std::string& file = options.common.configuration;
  if (!file.empty()) {
    auto loaded = load_configuration(file, {}, NamedFiles::kMayBeMissing);
    if (!loaded) return wrong_setup(loaded.error());
    configuration = *std::move(loaded);
  }
  if (!options.is_recorded()) return configuration.tracker.sensor;
  return calibrated_sensor(options.recorded.recording, configuration, file);
}

SetupExpected<Measurement> measure(const HandEyeOptions& options, const Console& console) {
  const auto result = options.is_recorded() ? by_recording(options.recorded, options.common, options.settings, console)
                                            : by_files(options);
  if (!result) return tl::unexpected(result.error());
  Measurement measured{text_of(*result), json_of(*result), {}};
  measured.keys = {{"hand_eye_translation_SC_mm", list_of(measured.json["translation_mm"])},
                   {"hand_eye_rotation_SC_wxyz", list_of(measured.json["rotation_wxyz"])}};
  // What check and perimapd look at: when it was measured, and of which sensor.
  measured.keys.push_back({"hand_eye_date", fmt::format("{:?}", date_now())});
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

struct TimeOptions {
  CommonOptions common;
  std::vector<std::string> signals;
  RecordedOptions recorded;
  LiveOptions live;
  double largest_offset_s = 1.0;

  [[nodiscard]] bool is_recorded() const { return !recorded.recording.empty(); }
  [[nodiscard]] std::vector<std::string> inputs() const {
    std::vector<std::string> all = signals;
    all.insert(all.end(), {recorded.recording, recorded.calibration});
    return all;
  }
  [[nodiscard]] std::vector<std::string> files() const { return signals; }
};

// By the motion of a board in view: what hand-eye calibration says of the clocks.
SetupExpected<Measurement> measure_recorded(const TimeOptions& options, const Console& console) {
  HandEyeSettings settings;
  settings.largest_offset_s = options.largest_offset_s;
  const auto result = by_recording(options.recorded, options.common, settings, console);
  if (!result) return tl::unexpected(result.error());
  if (!result->offset_measured) {
    return fail(options.recorded.recording +
                ": the board is seen too seldom to lay its motion over the tracker's: keep it in view and swing the "
                "scope on and on");
  }
  if (!result->is_brisk()) {
    return fail(
        fmt::format("{}: nothing moved briskly ({:.2f} rad/s within half a second, {:g} and more are needed), and what "
                    "is wrong with "
                    "the lens then passes for time: swing the scope briskly now and then, and record again",
                    options.recorded.recording, result->brisk_rad_per_s, HandEyeCalibration::kLeastBrisk_rad_per_s));
  }
  Measurement measured{
      offset_text_of(*result), offset_json_of(*result), {{"time_offset_ms", number_of(1e3 * result->offset_s)}}};
  measured.plots = plots_of(*result);
  return measured;
}

SetupExpected<Measurement> measure(const TimeOptions& options, const Console& console) {
  if (options.is_recorded()) return measure_recorded(options, console);
  if (options.signals.size() != 2) {
    return wrong_setup("calibrate time takes two signals, --signal A.csv --signal B.csv, or a recording with --from");
  }
  const auto first = read_signal_table(options.signals[0]);
  if (!first) return tl::unexpected(first.error());
  const auto second = read_signal_table(options.signals[1]);
  if (!second) return tl::unexpected(second.error());
  const auto result = measure_signal_offset(first->values, second->values, options.largest_offset_s);
  if (!result) return tl::unexpected(result.error());
  Measurement measured{text_of(*result), json_of(*result), {{"time_offset_ms", number_of(1e3 * result->offset_s)}}};
  measured.plots = plots_of(*result, first->values, second->values);
  return measured;
}

// Of either. What can be refused is refused before anything is recorded.
template <class Options>
Outcome run(Options& options, const Console& console) {
  if (auto able = check_outputs(options.common, options.inputs()); !able) return able;
  const bool live = !options.live.configuration.empty();
  options.recorded.live = options.live.configuration;
  const std::vector<std::string> files = named(options.files());
  if ((live || options.is_recorded()) && !files.empty()) {
    return refuse(joined(files) + ": not read beside --from or --live; expected one of them", ExitCode::kWrongUsage);
  }
  if (live || options.is_recorded()) {
    if (const auto able = check_motion_options(options.recorded, options.common.configuration); !able) {
      return refuse(able.error());
    }
  }
  const std::string made_from = live                    ? options.live.configuration
                                : options.is_recorded() ? options.recorded.recording
                                                        : joined(files);
  constexpr double kLeast_s = 25.0;
  const auto guide = live_board_guide(options.live, options.recorded, options.common.configuration, kLeast_s);
  if (!guide) return refuse(guide.error());
  return with_recording(options.live, kScopeTool, **guide, console, options.recorded.recording,
                        [&] { return finish(measure(options, console), options.common, made_from); });
}

}  // namespace

void add_calibrate_hand_eye(Commands& commands, Command& calibrate) {
  const auto options = std::make_shared<HandEyeOptions>();
  Command& command =
      commands.add(calibrate, "hand-eye",
                   "The camera's place in the tracked sensor, and the offset of the two clocks, from poses of both",
                   [options](const Console& console) { return run(*options, console); });
  command.add_option("--camera-poses", options->camera, "The camera in the board's frame: t_s,x,y,z,qx,qy,qz,qw");
  command.add_option("--tracker-poses", options->tracker, "The sensor in the tracker's frame, likewise");
  add_from(command, options->recorded.recording);
  add_live(command, options->live);
  add_lens_and_board(command, options->recorded);
  command.add_option("--largest-offset-s", options->settings.largest_offset_s, "The clocks differ by no more")
      ->check(Range(0.0, 3600.0))
      ->capture_default_str();
  add_common(command, options->common, true, true);
}

void add_calibrate_time(Commands& commands, Command& calibrate) {
  const auto options = std::make_shared<TimeOptions>();
  Command& command =
      commands.add(calibrate, "time", "The offset of two clocks, from a motion that both devices recorded",
                   [options](const Console& console) { return run(*options, console); });
  command.add_option("--signal", options->signals,
                     "Time and value, twice: first the camera's, then the tracker's. Gain and sign are found");
  add_from(command, options->recorded.recording);
  add_live(command, options->live);
  add_lens_and_board(command, options->recorded);
  command.add_option("--largest-offset-s", options->largest_offset_s, "The clocks differ by no more")
      ->check(Range(0.0, 3600.0))
      ->capture_default_str();
  add_common(command, options->common, false, true);
}

}  // namespace perimap

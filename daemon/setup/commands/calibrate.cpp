// `perimap calibrate`: lens, hand-eye, time offset, tool and tracker.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/setup/commands/calibrate_camera.hpp"
#include "daemon/setup/commands/measurement.hpp"
#include "daemon/setup/hand_eye.hpp"
#include "daemon/setup/kept_result.hpp"
#include "daemon/setup/setup_plots.hpp"
#include "daemon/setup/setup_report.hpp"
#include "daemon/setup/signal_offset.hpp"
#include "drivers/pose_file/pose_table.hpp"

namespace perimap {
namespace {

// ---- perimap calibrate hand-eye
struct HandEyeOptions {
  CommonOptions common;
  std::string camera;
  std::string tracker;
  HandEyeSettings settings;
};

Expected<Measurement> measure(const HandEyeOptions& options) {
  const auto camera = read_pose_table(options.camera, options.common.length_unit());
  if (!camera) return tl::unexpected(camera.error());
  const auto tracker = read_pose_table(options.tracker, options.common.length_unit());
  if (!tracker) return tl::unexpected(tracker.error());
  const auto result = calibrate_hand_eye(camera->poses, tracker->poses, options.settings);
  if (!result) return tl::unexpected(result.error());
  Measurement measured{text_of(*result), json_of(*result), {}};
  measured.keys = {{"hand_eye_translation_SC_mm", list_of(measured.json["translation_mm"])},
                   {"hand_eye_rotation_SC_wxyz", list_of(measured.json["rotation_wxyz"])}};
  measured.plots = plots_of(*result);
  if (result->offset_measured) measured.keys.push_back({"time_offset_ms", number_of(1e3 * result->offset_s)});
  return measured;
}

void add_hand_eye(Commands& commands, Command& calibrate) {
  const auto options = std::make_shared<HandEyeOptions>();
  Command& command =
      commands.add(calibrate, "hand-eye",
                   "The camera's place in the tracked sensor, and the offset of the two clocks, from poses of both",
                   [options](const Console&) -> Outcome {
                     const std::vector<std::string> inputs = {options->camera, options->tracker};
                     if (auto able = check_outputs(options->common, inputs); !able) return able;
                     return finish(measure(*options), options->common, joined(inputs));
                   });
  command.add_option("--camera-poses", options->camera, "The camera in the board's frame: t_s,x,y,z,qx,qy,qz,qw")
      ->required();
  command.add_option("--tracker-poses", options->tracker, "The sensor in the tracker's frame, likewise")->required();
  command.add_option("--largest-offset-s", options->settings.largest_offset_s, "The clocks differ by no more")
      ->check(Range(0.0, 3600.0))
      ->capture_default_str();
  add_common(command, options->common, true, true);
}

// ---- perimap calibrate time
struct TimeOptions {
  CommonOptions common;
  std::vector<std::string> signals;
  double largest_offset_s = 1.0;
};

Expected<Measurement> measure(const TimeOptions& options) {
  if (options.signals.size() != 2) return fail("calibrate time takes two signals: --signal A.csv --signal B.csv");
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

void add_time(Commands& commands, Command& calibrate) {
  const auto options = std::make_shared<TimeOptions>();
  Command& command =
      commands.add(calibrate, "time", "The offset of two clocks, from a motion that both devices recorded",
                   [options](const Console&) -> Outcome {
                     if (auto able = check_outputs(options->common, options->signals); !able) return able;
                     return finish(measure(*options), options->common, joined(options->signals));
                   });
  command
      .add_option("--signal", options->signals,
                  "Time and value, twice: first the camera's, then the tracker's. Gain and sign are found")
      ->required();
  command.add_option("--largest-offset-s", options->largest_offset_s, "The clocks differ by no more")
      ->check(Range(0.0, 3600.0))
      ->capture_default_str();
  add_common(command, options->common, false, true);
}

// ---- perimap calibrate tool, perimap calibrate tracker
struct PosesOptions {
  CommonOptions common;
  std::string poses;
};

Expected<Measurement> measure_tool(const PosesOptions& options) {
  const auto table = read_pose_table(options.poses, options.common.length_unit());
  if (!table) return tl::unexpected(table.error());
  const std::vector<TimedPose> poses = in_order(table->poses);
  const auto result = calibrate_pivot(poses);
  if (!result) return fail(options.poses + ": " + result.error().message);
  Measurement measured{text_of(*result), json_of(*result), {}};
  measured.plots = plots_of(*result, poses);
  return measured;
}

Expected<Measurement> measure_tracker(const PosesOptions& options) {
  const auto table = read_pose_table(options.poses, options.common.length_unit());
  if (!table) return tl::unexpected(table.error());
  const auto result = measure_tracker_noise(in_order(table->poses));
  if (!result) return fail(options.poses + ": " + result.error().message);
  Measurement measured{text_of(*result),
                       json_of(*result),
                       {{"position_deviation_mm", number_of(result->position_deviation_mm)},
                        {"rotation_deviation_deg", number_of(result->rotation_deviation_deg)},
                        {"error_correlation_s", number_of(result->correlation_s)}}};
  measured.plots = plots_of(*result);
  return measured;
}

// What is measured from poses of one sensor alone.
struct FromPoses {
  const char* name;
  const char* description;
  const char* poses;
  bool has_keys;
  Expected<Measurement> (*measure)(const PosesOptions&);
};

void add_from_poses(Commands& commands, Command& calibrate, const FromPoses& what) {
  const auto options = std::make_shared<PosesOptions>();
  Command& command =
      commands.add(calibrate, what.name, what.description, [options, take = what.measure](const Console&) -> Outcome {
        if (auto able = check_outputs(options->common, {options->poses}); !able) return able;
        return finish(take(*options), options->common, options->poses);
      });
  command.add_option("POSES", options->poses, what.poses)->required();
  add_common(command, options->common, true, what.has_keys);
}

}  // namespace

void add_calibrate_command(Commands& commands) {
  Command& calibrate = commands.add_group("calibrate", "Measures the set-up: each figure with its standard deviation");
  calibrate.footer(
      "A result that the data can not determine is refused with what is missing (exit code 1), and no file is "
      "changed.");
  add_hand_eye(commands, calibrate);
  add_calibrate_camera(commands, calibrate);
  add_time(commands, calibrate);
  add_from_poses(
      commands, calibrate,
      {"tool", "A tracked tool's tip, from poses while it turned about its resting tip",
       "The tool in the tracker's frame: t_s,x,y,z,qx,qy,qz,qw, or a time and a matrix", false, measure_tool});
  add_from_poses(
      commands, calibrate,
      {"tracker", "A tracker's noise and how long its errors last, from poses of a sensor that is held still",
       "The sensor in the tracker's frame: t_s,x,y,z,qx,qy,qz,qw, or a time and a matrix", true, measure_tracker});
}

}  // namespace perimap

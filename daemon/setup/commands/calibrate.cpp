// `perimap calibrate`: what is measured from poses of one tool, and the other calibrations.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/setup/commands/calibrate_camera.hpp"
#include "daemon/setup/commands/calibrate_hand_eye.hpp"
#include "daemon/setup/commands/calibrate_scope.hpp"
#include "daemon/setup/commands/calibrate_target.hpp"
#include "daemon/setup/commands/calibrate_time.hpp"
#include "daemon/setup/commands/live_capture.hpp"
#include "daemon/setup/commands/measurement.hpp"
#include "daemon/setup/commands/recorded_options.hpp"
#include "daemon/setup/kept_result.hpp"
#include "daemon/setup/live_guide.hpp"
#include "daemon/setup/moved_noise.hpp"
#include "daemon/setup/recorded_poses.hpp"
#include "daemon/setup/recorded_sensor.hpp"
#include "daemon/setup/setup_plots.hpp"
#include "daemon/setup/setup_report.hpp"
#include "drivers/pose_file/pose_table.hpp"

namespace perimap {
namespace {

// ---- perimap calibrate tool, perimap calibrate tracker
struct PosesOptions {
  CommonOptions common;
  std::string poses;      // file
  std::string recording;  // or this
  LiveOptions live;       // or this
  std::string tool;
  RecordedOptions moved;                       // of a tracker: the same sensor, moved before a board
  std::optional<MeasuredNoise> moved_noise{};  // by that

  [[nodiscard]] const std::string& input() const {
    if (!live.configuration.empty()) return live.configuration;
    return recording.empty() ? poses : recording;
  }
};

SetupExpected<std::vector<TimedPose>> poses_of(const PosesOptions& options) {
  if (!options.recording.empty()) return read_recorded_poses(options.recording, options.tool);
  const auto table = read_pose_table(options.poses, options.common.length_unit(), options.common.unit_of_times());
  if (!table) return tl::unexpected(table.error());
  return in_order(table->poses);
}

// As check compares it with tracker.pointer. A recording, and one of live devices is one too, has its poses by the
// tool's role, and says which tool had it.
Expected<std::string> tool_of(const PosesOptions& options) {
  if (options.recording.empty()) return options.tool;
  const auto handle = recorded_handle(options.recording, options.tool);
  if (!handle) return tl::unexpected(handle.error());
  return handle->value_or(options.tool);
}

SetupExpected<Measurement> measure_tool(const PosesOptions& options) {
  const auto poses = poses_of(options);
  if (!poses) return tl::unexpected(poses.error());
  const auto result = calibrate_pivot(*poses);
  if (!result) return fail(options.input() + ": " + result.error().message);
  Measurement measured{text_of(*result), json_of(*result), {}};
  const auto tool = tool_of(options);
  if (!tool) return tl::unexpected(tool.error());
  measured.json["tool"] = *tool;
  measured.keys = {{"pointer_calibration", output_key(options.common)}};
  measured.plots = plots_of(*result, *poses);
  return measured;
}

SetupExpected<MeasuredNoise> moved_noise_of(const PosesOptions& options, const Console& console) {
  auto motion = motion_of(options.moved, options.common.configuration, console);
  if (!motion) return tl::unexpected(motion.error());
  const auto hand_eye = calibrate_hand_eye(std::move(motion->camera_poses), std::move(motion->sensor_poses), {});
  if (!hand_eye) return fail(options.moved.recording + ": " + hand_eye.error().message);
  auto noise = noise_while_moved(*hand_eye);
  if (!noise) return fail(options.moved.recording + ": its poses before the board: " + noise.error().message);
  return *std::move(noise);
}

SetupExpected<Measurement> measure_tracker(const PosesOptions& options) {
  const auto poses = poses_of(options);
  if (!poses) return tl::unexpected(poses.error());
  auto still = measure_tracker_noise(*poses);
  if (!still) return fail(options.input() + ": " + still.error().message);
  TrackerErrors errors{*std::move(still), std::nullopt};
  errors.moved = options.moved_noise;
  Measurement measured{text_of(errors),
                       json_of(errors),
                       {{"position_deviation_mm", number_of(errors.position_deviation_mm())},
                        {"rotation_deviation_deg", number_of(errors.rotation_deviation_deg())},
                        {"error_correlation_s", number_of(errors.correlation_s())}}};
  measured.plots = plots_of(errors);
  return measured;
}

// Before anything is recorded or measured at rest, which takes a minute: what is wrong with --moved is told at once.
Outcome measure_moved(PosesOptions& options, const Console& console) {
  if (options.moved.recording.empty()) {
    if (!has_lens_or_board(options.moved)) return {};
    return refuse("--calibration, --board-tool and what tells of a board: expected --moved, whose board it is",
                  ExitCode::kWrongUsage);
  }
  options.moved.live = options.live.configuration;
  if (const auto able = check_motion_options(options.moved, options.common.configuration); !able) {
    return refuse(able.error());
  }
  auto noise = moved_noise_of(options, console);
  if (!noise) return refuse(noise.error());
  options.moved_noise = *std::move(noise);
  return {};
}

// What is measured from poses of one sensor alone.
struct FromPoses {
  const char* name;
  const char* description;
  const char* poses;
  const char* tool;   // of a recording, where none is named
  bool names_output;  // the configuration is to name the file, and has no keys of the result
  bool has_moved;     // the same sensor may have been moved before a board
  SetupExpected<Measurement> (*measure)(const PosesOptions&);
  std::unique_ptr<LiveGuide> (*guide)(double least_s);
  double least_s;  // live
};

void add_from_poses(Commands& commands, Command& calibrate, const FromPoses& what) {
  const auto options = std::make_shared<PosesOptions>();
  Command& command =
      commands.add(calibrate, what.name, what.description, [options, what](const Console& console) -> Outcome {
        const std::vector<std::string> inputs = {options->poses, options->recording, options->moved.recording,
                                                 options->moved.calibration};
        if (auto able = check_outputs(options->common, inputs); !able) return able;
        if (options->input().empty()) {
          return refuse("expected a file of poses, a recording with --from, or devices with --live",
                        ExitCode::kWrongUsage);
        }
        if (!options->poses.empty() && options->input() != options->poses) {
          return refuse(options->poses + ": not read beside --from or --live; expected one of them",
                        ExitCode::kWrongUsage);
        }
        if (what.names_output && !options->common.configuration.empty() && options->common.output.empty()) {
          return refuse("--configuration: expected --output too, the file that the configuration is to name",
                        ExitCode::kWrongUsage);
        }
        if (auto moved = measure_moved(*options, console); !moved) return moved;
        const std::string made_from = joined(named({options->input(), options->moved.recording}));
        const auto guide = what.guide(what.least_s);
        return with_recording(options->live, options->tool, *guide, console, options->recording, [&] {
          return finish(what.measure(*options), options->common, made_from, options->recording);
        });
      });
  options->tool = what.tool;
  command.add_option("POSES", options->poses, what.poses);
  add_from(command, options->recording);
  add_live(command, options->live);
  command
      .add_option(
          "--tool", options->tool,
          "The tracked tool: with --from or --live one of the recording's, scope being the scope's sensor; with a "
          "file what it is written down as")
      ->capture_default_str();
  add_time_unit(command, options->common);
  if (what.has_moved) {
    command.add_option("--moved", options->moved.recording,
                       "A recording (MCAP) of the same sensor, on the scope, moved before a board: what it errs then "
                       "counts where it is more");
    add_lens_and_board(command, options->moved);
  }
  add_common(command, options->common, true, true);
}

}  // namespace

void add_calibrate_command(Commands& commands) {
  Command& calibrate = commands.add_group("calibrate", "Measures the set-up: each figure with its standard deviation");
  calibrate.footer(
      "A result that the data can not determine is refused with what is missing (exit code 1), and no file is "
      "changed.");
  add_calibrate_target(commands, calibrate);
  add_calibrate_camera(commands, calibrate);
  add_calibrate_hand_eye(commands, calibrate);
  add_calibrate_time(commands, calibrate);
  add_calibrate_scope(commands, calibrate);
  add_from_poses(commands, calibrate,
                 {"tool", "A tracked tool's tip, from poses while it turned about its resting tip",
                  "The tool in the tracker's frame: t_s,x,y,z,qx,qy,qz,qw, or a time and a matrix", "pointer", true,
                  false, measure_tool, pivot_guide, 20.0});
  add_from_poses(
      commands, calibrate,
      {"tracker", "A tracker's noise and how long its errors last, from poses of a sensor that is held still",
       "The sensor in the tracker's frame: t_s,x,y,z,qx,qy,qz,qw, or a time and a matrix", kScopeTool, false, true,
       measure_tracker, still_guide, 60.0});
}

}  // namespace perimap

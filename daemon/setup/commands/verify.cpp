// `perimap verify`: whether the set-up is right, before a session.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/angle/angle.hpp"
#include "daemon/command_line/commands.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/tracked_tools.hpp"
#include "daemon/runtime/calibration_fit.hpp"
#include "daemon/setup/commands/live_capture.hpp"
#include "daemon/setup/commands/measurement.hpp"
#include "daemon/setup/commands/recorded_options.hpp"
#include "daemon/setup/recorded_poses.hpp"
#include "daemon/setup/recorded_relation.hpp"
#include "daemon/setup/recorded_sensor.hpp"
#include "daemon/setup/scope_rotation.hpp"
#include "daemon/setup/verification.hpp"
#include "drivers/calibration/tool_tip.hpp"
#include "drivers/calibration/turned_scope_file.hpp"

namespace perimap {
namespace {

struct VerifyOptions {
  CommonOptions common;
  std::string configuration;
  RecordedOptions recorded;
  bool live = false;
  double longest_s = 60.0;
  std::string tip;
  std::string tool = "pointer";
  std::vector<double> touched_mm{0.0, 0.0};
  double bound_mm = 2.0;
};

Expected<std::optional<TouchOnTrial>> touch_of(const VerifyOptions& options) {
  if (options.tip.empty()) return std::nullopt;
  const auto tip = read_tool_tip(options.tip);
  if (!tip) return tl::unexpected(tip.error());
  const auto poses = read_recorded_poses(options.recorded.recording, options.tool);
  if (!poses) return tl::unexpected(poses.error());
  TouchOnTrial touch;
  for (const TimedPose& pose : *poses) touch.tip_W.push_back({pose.t_s, pose.X * tip->tip_T});
  touch.touched_B = Vector3d(options.touched_mm.at(0), options.touched_mm.at(1), 0.0);
  touch.tip_deviation_mm = std::sqrt(std::max(0.0, tip->covariance_T.trace()));
  return touch;
}

Vector3d middle_of(const std::vector<TimedView>& views) {
  Vector3d sum = Vector3d::Zero();
  double count = 0.0;
  for (const TimedView& seen : views) {
    for (const Vector3d& p : seen.view.board_mm) sum += p, count += 1.0;
  }
  return sum / std::max(1.0, count);
}

nlohmann::json json_of(const Verification& result, const VerifyOptions& options) {
  nlohmann::json json = {{"passed", result.passed()},
                         {"bound_mm", result.bound_mm},
                         {"configuration", options.configuration},
                         {"latency_ms", 0},
                         {"board_error_mm", result.error_mm},
                         {"board_error_mm_deviation", result.error_mm_deviation},
                         {"clock_error_ms", result.clock_error_ms},
                         {"clock_error_ms_deviation", result.clock_error_ms_deviation},
                         {"scatter_mm", result.scatter_mm},
                         {"views", result.views},
                         {"views_left_out", result.views_left_out},
                         {"watched_s", result.watched_s},
                         {"unseen_mm", nullptr},
                         {"touch_error_mm", nullptr},
                         {"touch_error_mm_deviation", nullptr}};
  if (result.touch) {
    json["touch_error_mm"] = result.touch->error_mm;
    json["touch_error_mm_deviation"] = result.touch->error_mm_deviation;
    const Vector3d& e = result.touch->error_W_mm;
    json["touch_error_W_mm"] = {e.x(), e.y(), e.z()};
  }
  if (!result.touch && result.board_passed()) json["unseen_mm"] = result.unseen_mm;
  return json;
}

// The set-up as the scope was turned and zoomed while it was recorded.
struct SetupAsTurned {
  Pose X_SC;
  LensAtTurn lens;
};

SetupExpected<SetupAsTurned> setup_as_turned(const std::filesystem::path& file, const std::string& recording) {
  const auto scope = read_turned_scope(file);
  if (!scope) return wrong_setup(scope.error());
  if (scope->second_sensor) {
    const auto relation = relation_in_recording(recording);
    if (!relation) return tl::unexpected(relation.error());
    const double rotation_rad = scope->second_sensor->rotation_rad(relation->R_S2);
    constexpr double kSlipped_rad = 2.0 * kDegree;
    if (const double aside_rad = scope->second_sensor->aside_rad(relation->R_S2); aside_rad > kSlipped_rad) {
      return fail(
          fmt::format("{}: the two sensors are {:.1f} degrees from every turn about the shaft that {} has: one "
                      "has slipped; fasten it, and measure the scope anew",
                      recording, aside_rad / kDegree, file.string()));
    }
    return SetupAsTurned{scope->at(rotation_rad).X_SC, *scope->lens_at(rotation_rad, 0.0)};
  }
  const auto rotation = rotation_in_recording(recording);
  if (!rotation) return tl::unexpected(rotation.error());
  constexpr double kHeld_rad = 2.0 * kDegree;
  if (rotation->spread_rad > kHeld_rad) {
    return fail(recording + ": the scope was turned in its camera head meanwhile; hold it, and record again");
  }
  const auto lens = scope->lens_at(rotation->rotation_rad, rotation->radius_px);
  if (!lens) {
    return fail(fmt::format("{}: is of a zoom that {} has not: zoom back, or measure lens and scope at this zoom too",
                            recording, file.string()));
  }
  return SetupAsTurned{scope->at(rotation->rotation_rad).X_SC, *lens};
}

// What is on trial must be of the sensors whose poses were recorded. Lens and tip may be others than the
// configuration's.
SetupExpected<void> sensor_fits(Configuration configuration, const VerifyOptions& options) {
  auto sensor = calibrated_sensor(options.recorded.recording, configuration, options.configuration);
  if (!sensor) return tl::unexpected(sensor.error());
  configuration.tracker.sensor = *std::move(sensor);
  auto second = recorded_handle(options.recorded.recording, kSecondSensorTool);
  if (!second) return tl::unexpected(second.error());
  if (*second) configuration.tracker.second_sensor = *std::move(second);
  configuration.tracker.pointer_calibration.reset();
  configuration.camera.calibration.reset();
  configuration.camera.width = configuration.camera.height = 0;
  if (auto wrong = wrong_calibrations(configuration); !wrong.empty()) {
    return wrong_setup(told_in(options.configuration, std::move(wrong)));
  }
  return {};
}

SetupExpected<Verification> verify(const VerifyOptions& options, const Console& console) {
  const auto configuration = load_configuration(options.configuration, {}, NamedFiles::kMayBeMissing);
  if (!configuration) return wrong_setup(configuration.error());
  if (const auto fits = sensor_fits(*configuration, options); !fits) return tl::unexpected(fits.error());
  const TrackerConfiguration& tracker = configuration->tracker;
  SetupOnTrial setup{
      pose_from_wxyz(Vector3d(tracker.translation_SC_mm[0], tracker.translation_SC_mm[1], tracker.translation_SC_mm[2]),
                     tracker.rotation_SC_wxyz),
      to_seconds(tracker.time_offset)};
  RecordedOptions recorded = options.recorded;
  if (configuration->camera.turned_scope) {
    const auto turned = setup_as_turned(*configuration->camera.turned_scope, recorded.recording);
    if (!turned) return tl::unexpected(turned.error());
    setup.X_SC = turned->X_SC;
    recorded.lens_as_turned = turned->lens;
  }
  const auto touch = touch_of(options);
  if (!touch) return tl::unexpected(touch.error());
  const auto motion = recorded_motion(recorded, options.configuration, console);
  if (!motion) return tl::unexpected(motion.error());
  auto result = verify_setup(motion->camera_poses, motion->sensor_poses, middle_of(motion->board.views), setup, *touch,
                             options.bound_mm);
  if (!result) return fail(options.recorded.recording + ": " + result.error().message);
  return *std::move(result);
}

std::string advice_of(const Verification& result) {
  if (!result.clock_passed()) {
    constexpr double kUnknown = 2.0;  // deviations within which it may as well be right
    if (std::abs(result.clock_error_ms) < kUnknown * result.clock_error_ms_deviation) {
      return "the scope was swung too slowly to tell whether the time offset is right: swing it briskly, and for "
             "longer";
    }
    return fmt::format(
        "the clocks of camera and tracker are {:.1f} ms off: measure the time offset anew (perimap calibrate time)",
        result.clock_error_ms);
  }
  if (!result.board_passed()) {
    return "the board wanders as the scope moves: measure lens, hand-eye and time offset anew (perimap calibrate), and "
           "look whether the sensor is loose on the scope";
  }
  return "camera and pointer disagree: measure the pointer's tip and the hand-eye anew (perimap calibrate), and look "
         "whether the point touched is the one named";
}

Outcome verified(const VerifyOptions& options, const std::string& made_from, const Console& console) {
  const auto result = verify(options, console);
  if (!result) return refuse(result.error());
  Measurement measured{text_of(*result), json_of(*result, options), {}};
  measured.plots = plots_of(*result);
  if (auto finished = finish(measured, options.common, made_from); !finished) return finished;
  if (!result->passed()) {
    return refuse(fmt::format("not within {:g} mm: {}", options.bound_mm, advice_of(*result)));
  }
  return {};
}

Outcome run(VerifyOptions& options, const Console& console) {
  const std::vector<std::string> inputs = {options.configuration, options.recorded.recording,
                                           options.recorded.calibration, options.tip};
  if (auto able = check_outputs(options.common, inputs); !able) return able;
  if (options.live == !options.recorded.recording.empty()) {
    return refuse("expected a recording with --from, or --live for the configuration's own devices",
                  ExitCode::kWrongUsage);
  }
  if (const auto sound = load_configuration(options.configuration, {}, NamedFiles::kMayBeMissing); !sound) {
    return refuse(sound.error(), ExitCode::kWrongUsage);
  }
  if (const auto able = check_motion_options(options.recorded, options.configuration); !able) {
    return refuse(able.error());
  }
  LiveOptions live;
  if (options.live) live.configuration = options.configuration;
  live.longest_s = options.longest_s;
  const std::string made_from = options.live ? options.configuration : options.recorded.recording;
  constexpr double kLeast_s = 10.0;
  const auto guide = live_board_guide(live, options.recorded, options.configuration, kLeast_s);
  if (!guide) return refuse(guide.error());
  return with_recording(live, kScopeTool, **guide, console, options.recorded.recording,
                        [&] { return verified(options, made_from, console); });
}

}  // namespace

void add_verify_command(Commands& commands) {
  const auto options = std::make_shared<VerifyOptions>();
  Command& command = commands.add(
      "verify", "Whether the set-up is right, before a session: the error on the spot, in mm, against a bound",
      [options](const Console& console) { return run(*options, console); });
  command.footer(
      "Swing the scope about a board that stays where it is, by 20 degrees and more about all axes, for ten seconds; "
      "with the tip of a calibrated pointer resting on a point of the board the error is absolute. Exit code 1: not "
      "within the bound, or not determined.");
  command.add_option("CONFIGURATION", options->configuration, "The configuration on trial (TOML)")->required();
  command.add_option("--from", options->recorded.recording, "A recording of perimap record (MCAP)");
  command.add_flag("--live", options->live, "Of the configuration's own devices, now");
  command.add_option("--seconds", options->longest_s, "With --live: for so long at most")
      ->check(Range(10.0, 3600.0))
      ->capture_default_str();
  add_lens_and_board(command, options->recorded);
  command.add_option("--tip", options->tip, "The pointer's tip, as perimap calibrate tool --output wrote it");
  command.add_option("--tool", options->tool, "The tracked tool that is the pointer")->capture_default_str();
  command
      .add_option(
          "--touched", options->touched_mm,
          "x y of the touched point on the board, mm: from a chessboard's first inner corner, or from the upper "
          "left corner of a ChArUco board's squares, to the right and downwards")
      ->expected(2)
      ->capture_default_str();
  command.add_option("--bound-mm", options->bound_mm, "What the error and two of its deviations must not exceed")
      ->check(Range(0.01, 1000.0))
      ->capture_default_str();
  add_common(command, options->common, false, false);
}

}  // namespace perimap

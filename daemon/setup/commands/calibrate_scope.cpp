#include "daemon/setup/commands/calibrate_scope.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/tracked_tools.hpp"
#include "daemon/setup/commands/board_options.hpp"
#include "daemon/setup/commands/frame_progress.hpp"
#include "daemon/setup/commands/live_capture.hpp"
#include "daemon/setup/commands/measurement.hpp"
#include "daemon/setup/commands/recorded_options.hpp"
#include "daemon/setup/recorded_poses.hpp"
#include "daemon/setup/scope_calibration.hpp"
#include "daemon/setup/scope_guide.hpp"

namespace perimap {
namespace {

struct CalibrateScopeOptions {
  CommonOptions common;
  ScopeCalibrationSource source;
  BoardOptions board;
  LiveOptions live;
  unsigned turns = 3;  // live
  unsigned zooms = 0;  // likewise, others than that of the turns

  [[nodiscard]] bool is_live() const { return !live.configuration.empty(); }
  [[nodiscard]] bool by_one_recording() const {
    return source.setups.empty() && source.pictures.empty() && board.square_mm > 0.0 &&
           (is_live() || !source.recording.empty());
  }
  // The function of the turn, and not how far the scope is turned alone.
  [[nodiscard]] bool makes_function() const { return !source.setups.empty() || by_one_recording(); }
  // All that is read, but the configuration, which may take the result.
  [[nodiscard]] std::vector<std::string> inputs() const {
    std::vector<std::string> all = source.recording.empty() ? source.pictures : std::vector{source.recording};
    for (const ScopeAtTurn& files : source.setups) all.insert(all.end(), {files.seen, files.hand_eye, files.camera});
    for (const ScopeAtZoom& files : source.zooms) all.insert(all.end(), {files.seen, files.camera});
    return all;
  }
};

SetupExpected<Measurement> measure(const CalibrateScopeOptions& options, const Console& console) {
  const auto result = calibrate_scope(options.source, FrameProgress(console));
  if (!result) return tl::unexpected(result.error());
  Measurement measured{"", nlohmann::json::object(), {}};
  if (result->scope) {
    measured.text += text_of(*result->scope);
    measured.json["turned_scope"] = json_of(*result->scope);
    // Check and perimapd refuse it with another.
    if (result->sensor) measured.json["sensor"] = *result->sensor;
    if (result->second_sensor) measured.json["second_sensor"] = *result->second_sensor;
    measured.section = "camera";
    measured.keys = {{"turned_scope", output_key(options.common)}};
    measured.plots = plots_of(*result->scope, result->setups);
  }
  if (result->turns) {
    measured.text += text_of(*result->turns);
    measured.json.update(json_of(*result->turns));
  }
  if (result->rotation) {
    measured.text += text_of(*result->rotation);
    measured.json.update(json_of(*result->rotation));
    measured.plots = plots_of(*result->rotation);
  }
  return measured;
}

// The options together, before anything is read or recorded.
Outcome check_options(const CalibrateScopeOptions& options) {
  const ScopeCalibrationSource& source = options.source;
  const auto wrong = [](const std::string& what) { return refuse(what, ExitCode::kWrongUsage); };
  if (options.is_live() && !(source.setups.empty() && source.pictures.empty())) {
    return wrong("--live: expected no pictures and no --at beside it; it records every turn itself");
  }
  if (options.board.square_mm > 0.0 && !options.by_one_recording()) {
    return wrong("--square-mm: expected --live or --from beside it, and no pictures and no --at");
  }
  if (source.by_second_sensor && options.is_live() && options.turns < 3) {
    return wrong("--turns: expected three and more with --by-second-sensor");
  }
  if (options.zooms > 0 && (!options.is_live() || !options.by_one_recording() || source.by_second_sensor)) {
    return wrong("--zooms: expected --live and --square-mm beside it, and no --by-second-sensor, which tells no zoom");
  }
  if (!source.zooms.empty() && !options.makes_function()) {
    return wrong("--zoom: expected --at too, the set-ups at several turns, or --square-mm");
  }
  if (source.by_second_sensor && (!options.makes_function() || !source.zooms.empty())) {
    return wrong(
        "--by-second-sensor: expected --at, or --square-mm with --live or --from, and no --zoom, of which it does not "
        "tell");
  }
  if (!options.common.configuration.empty() && (options.common.output.empty() || !options.makes_function())) {
    return wrong(
        "--configuration: expected --at, or --square-mm with --live or --from; and --output, the file that the "
        "configuration is to name");
  }
  if (!options.is_live() || !source.by_second_sensor) return {};
  const auto configuration = load_configuration(options.live.configuration, {}, NamedFiles::kMayBeMissing);
  if (!configuration) return refuse(configuration.error(), ExitCode::kWrongUsage);
  if (second_sensor_of(tracked_tool_names(configuration->tracker))) return {};
  return wrong(options.live.configuration + ": names no tracker.second_sensor, which is to tell the turn");
}

Outcome run(CalibrateScopeOptions& options, const Console& console) {
  if (auto sound = check_options(options); !sound) return sound;
  const auto board = wish_of(options.board);
  if (!board) return refuse(board.error());
  options.source.board = *board;
  const std::string made_from = options.is_live() ? options.live.configuration : joined(options.inputs());
  if (auto able = check_outputs(options.common, options.inputs()); !able) return able;
  options.source.configuration = options.common.configuration;
  const auto guide = options.by_one_recording()
                         ? scope_guide({*board, options.turns, options.zooms, ScopeGuideSettings{}.least_s,
                                        options.source.by_second_sensor})
                         : notch_guide();
  return with_recording(options.live, kScopeTool, *guide, console, options.source.recording, [&] {
    return finish(measure(options, console), options.common, made_from, options.source.recording);
  });
}

}  // namespace

void add_calibrate_scope(Commands& commands, Command& calibrate) {
  const auto options = std::make_shared<CalibrateScopeOptions>();
  Command& command = commands.add(calibrate, "scope",
                                  "How far an angled scope is turned in its camera head, by its field stop's notch or "
                                  "a second tracked sensor; and the "
                                  "set-up by it",
                                  [options](const Console& console) { return run(*options, console); });
  command.footer(
      "With --square-mm, --from takes one recording of a scope that is swung about a board, turned in its camera head "
      "by "
      "60 degrees and more, held there while it is swung again, and so on; --live makes it and says what is missing. "
      "The turns are of one zoom, the first; while the scope is held at another one the lens alone is measured, for "
      "the "
      "table of focal lengths by the field stop's radius. "
      "What --output then writes, or of --at, goes into a configuration as camera.turned_scope: perimapd, replay and "
      "verify then "
      "read turn and zoom from the field stop in the pictures, or the turn from tracker.second_sensor, and take "
      "hand-eye and "
      "lens by them.");
  command.add_option("IMAGES", options->source.pictures, "Pictures with the field stop, folders of them, or a video");
  add_from(command, options->source.recording);
  constexpr double kLongest_s = 600.0;
  options->live.longest_s = kLongest_s;
  add_live(command, options->live);
  command.add_option("--turns", options->turns, "With --live and --square-mm: at so many turns")
      ->check(Range(2U, 12U))
      ->capture_default_str();
  command
      .add_option("--zooms", options->zooms,
                  "With --live and --square-mm: and at so many zooms or foci other than that of the turns, as at both "
                  "ends and between")
      ->check(Range(0U, 12U))
      ->capture_default_str();
  add_board(command, options->board);
  command
      .add_option_function<std::vector<std::string>>(
          "--at",
          [options](const std::vector<std::string>& files) {
            options->source.setups.push_back({files.at(0), files.at(1), files.at(2)});
          },
          "PICTURE HAND_EYE CAMERA: a picture or a recording at one turn of the scope, and what perimap calibrate "
          "hand-eye --output and calibrate camera --output wrote then; give it twice and more, for the set-up as a "
          "function of the turn")
      ->expected(3)
      ->trigger_on_parse();
  command
      .add_option_function<std::vector<std::string>>(
          "--zoom",
          [options](const std::vector<std::string>& files) {
            options->source.zooms.push_back({files.at(0), files.at(1)});
          },
          "PICTURE CAMERA: with --at, a picture or a recording at another zoom or focus, and what perimap calibrate "
          "camera --output wrote then: the table of focal lengths by the field stop's radius; between those it is read "
          "along a line")
      ->expected(2)
      ->trigger_on_parse();
  command.add_flag(
      "--by-second-sensor", options->source.by_second_sensor,
      "With --at, three times and more, each a recording, or with --square-mm: the turn is told by a second tracked "
      "sensor, "
      "recorded as tracker/second_sensor, on the scope where the sensor is on the camera head or the other "
      "way round; the pictures need no field stop, and the zoom must stay as it was");
  add_common(command, options->common, false, true);
}

}  // namespace perimap

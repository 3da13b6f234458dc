#include "daemon/setup/commands/calibrate_scope.hpp"

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/setup/commands/measurement.hpp"
#include "daemon/setup/commands/recorded_options.hpp"
#include "daemon/setup/scope_calibration.hpp"

namespace perimap {
namespace {

struct CalibrateScopeOptions {
  CommonOptions common;
  ScopeCalibrationSource source;

  // All that is read, but the configuration, which may take the result.
  [[nodiscard]] std::vector<std::string> inputs() const {
    std::vector<std::string> all = source.recording.empty() ? source.pictures : std::vector{source.recording};
    for (const ScopeAtTurn& files : source.setups) all.insert(all.end(), {files.seen, files.hand_eye, files.camera});
    for (const ScopeAtZoom& files : source.zooms) all.insert(all.end(), {files.seen, files.camera});
    return all;
  }
};

SetupExpected<Measurement> measure(const CalibrateScopeOptions& options) {
  const auto result = calibrate_scope(options.source);
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
  }
  if (result->rotation) {
    measured.text += text_of(*result->rotation);
    measured.json.update(json_of(*result->rotation));
    measured.plots = plots_of(*result->rotation);
  }
  return measured;
}

Outcome run(CalibrateScopeOptions& options) {
  const ScopeCalibrationSource& source = options.source;
  if (!source.zooms.empty() && source.setups.empty()) {
    return refuse("--zoom: expected --at too, the set-ups at several turns", ExitCode::kWrongUsage);
  }
  if (source.by_second_sensor && (source.setups.empty() || !source.zooms.empty())) {
    return refuse("--by-second-sensor: expected --at, and no --zoom, of which it does not tell", ExitCode::kWrongUsage);
  }
  if (!options.common.configuration.empty() && (options.common.output.empty() || source.setups.empty())) {
    return refuse("--configuration: expected --at and --output too, the file that the configuration is to name",
                  ExitCode::kWrongUsage);
  }
  const std::vector<std::string> read = options.inputs();
  if (auto able = check_outputs(options.common, read); !able) return able;
  options.source.configuration = options.common.configuration;
  return finish(measure(options), options.common, joined(read));
}

}  // namespace

void add_calibrate_scope(Commands& commands, Command& calibrate) {
  const auto options = std::make_shared<CalibrateScopeOptions>();
  Command& command = commands.add(calibrate, "scope",
                                  "How far an angled scope is turned in its camera head, by its field stop's notch or "
                                  "a second tracked sensor; and the "
                                  "set-up by it",
                                  [options](const Console&) { return run(*options); });
  command.footer(
      "What --at and --output write goes into a configuration as camera.turned_scope: perimapd, replay and verify then "
      "read turn and zoom from the field stop in the pictures, or the turn from tracker.second_sensor, and take "
      "hand-eye and "
      "lens by them.");
  command.add_option("IMAGES", options->source.pictures, "Pictures with the field stop, folders of them, or a video");
  add_from(command, options->source.recording);
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
      "With --at, three times and more, each a recording: the turn is told by a second tracked sensor, "
      "recorded as tracker/second_sensor, on the scope where the sensor is on the camera head or the other "
      "way round; the pictures need no field stop, and the zoom must stay as it was");
  add_common(command, options->common, false, true);
}

}  // namespace perimap

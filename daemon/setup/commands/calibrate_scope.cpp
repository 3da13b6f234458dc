#include "daemon/setup/commands/calibrate_scope.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/calibration/fit_by_second_sensor.hpp"
#include "daemon/command_line/commands.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/tracked_tools.hpp"
#include "daemon/setup/commands/measurement.hpp"
#include "daemon/setup/commands/pictures.hpp"
#include "daemon/setup/commands/recorded_options.hpp"
#include "daemon/setup/recorded_relation.hpp"
#include "daemon/setup/recorded_sensor.hpp"
#include "daemon/setup/scope_rotation.hpp"
#include "drivers/calibration/calibration_facts.hpp"
#include "drivers/calibration/calibration_file.hpp"

namespace perimap {
namespace {

struct CalibrateScopeOptions {
  CommonOptions common;
  std::vector<std::string> pictures;
  std::string recording;
  std::vector<std::vector<std::string>> setups;  // picture or recording, hand-eye, camera
  std::vector<std::vector<std::string>> zooms;   // picture or recording, camera
  bool by_second_sensor = false;

  [[nodiscard]] std::vector<std::string> inputs() const {
    return recording.empty() ? pictures : std::vector{recording};
  }
};

Expected<ScopeRotation> rotation_in_pictures(const std::vector<std::string>& named) {
  const auto pictures = read_pictures(named);
  if (!pictures) return tl::unexpected(pictures.error());
  NotchReadings readings;
  for (const NamedPicture& picture : *pictures) readings.add(picture.name, 0.0, picture.grey());
  return std::move(readings).rotation();
}

bool is_recording(const std::string& file) { return std::filesystem::path(file).extension() == ".mcap"; }

// The field stop in a picture or a recording, and the lens that was calibrated then.
struct SeenWithLens {
  ScopeRotation stop;
  CameraModel lens;
};

Expected<SeenWithLens> seen_with_lens(const std::string& seen, const std::string& lens_file) {
  auto stop = is_recording(seen) ? rotation_in_recording(seen) : rotation_in_pictures({seen});
  if (!stop) return tl::unexpected(stop.error());
  const auto lens = read_calibration(lens_file);
  if (!lens) return tl::unexpected(lens.error());
  if (stop->width != lens->width || stop->height != lens->height) {
    return fail(fmt::format("{}: is {}x{}, and {} is for {}x{}: they belong to one camera as it is used", seen,
                            stop->width, stop->height, lens_file, lens->width, lens->height));
  }
  return SeenWithLens{*std::move(stop), *lens};
}

Expected<void> same_size(const CameraModel& lens, const std::string& lens_file, const CameraModel& first) {
  if (lens.width == first.width && lens.height == first.height) return {};
  return fail(
      fmt::format("{}: is for {}x{}, and the ones before are for {}x{}: they belong to one camera as it is used",
                  lens_file, lens.width, lens.height, first.width, first.height));
}

// The set-up as a function of the rotation, from those that --at names, where a second sensor tells that.
Expected<TurnedScope> scope_by_second_sensor(const CalibrateScopeOptions& options) {
  std::vector<SetupAtRotation> setups;
  std::vector<HeldRelation> held;
  std::optional<CameraModel> first;
  for (const std::vector<std::string>& files : options.setups) {
    const auto relation = relation_in_recording(files.at(0));
    if (!relation) return tl::unexpected(relation.error());
    const auto lens = read_calibration(files.at(2));
    if (!lens) return tl::unexpected(lens.error());
    if (!first) first = *lens;
    if (const auto same = same_size(*lens, files.at(2), *first); !same) return tl::unexpected(same.error());
    const auto setup = read_setup(files.at(1), files.at(2));
    if (!setup) return tl::unexpected(setup.error());
    setups.push_back(*setup);
    held.push_back(*relation);
  }
  auto scope = fit_by_second_sensor(std::move(setups), held);
  if (!scope) return scope;
  scope->width = first->width;
  scope->height = first->height;
  return scope;
}

// The set-up as a function of the rotation, from those that --at names, and of the zoom, from those of --zoom too.
Expected<TurnedScope> turned_scope(const CalibrateScopeOptions& options) {
  std::vector<SetupAtRotation> setups;
  std::optional<CameraModel> first;
  Vector2d turn_px = Vector2d::Zero();
  for (const std::vector<std::string>& files : options.setups) {
    const auto seen = seen_with_lens(files.at(0), files.at(2));
    if (!seen) return tl::unexpected(seen.error());
    auto setup = read_setup(files.at(1), files.at(2));
    if (!setup) return tl::unexpected(setup.error());
    if (!first) first = seen->lens;
    if (const auto same = same_size(seen->lens, files.at(2), *first); !same) return tl::unexpected(same.error());
    setup->rotation_rad = seen->stop.rotation_rad;
    setup->rotation_deviation_rad = seen->stop.rotation_deviation_rad;
    setup->radius_px = seen->stop.radius_px;
    setups.push_back(*setup);
    turn_px += seen->stop.centre_px / static_cast<double>(options.setups.size());
  }
  auto scope = fit_turned_scope(setups, turn_px);
  if (!scope) return scope;
  scope->width = first->width;
  scope->height = first->height;
  for (const std::vector<std::string>& files : options.zooms) {
    const auto seen = seen_with_lens(files.at(0), files.at(1));
    if (!seen) return tl::unexpected(seen.error());
    if (const auto same = same_size(seen->lens, files.at(1), *first); !same) return tl::unexpected(same.error());
    scope->focals.push_back({seen->stop.radius_px, {seen->lens.fx, seen->lens.fy}});
  }
  scope->focals = focal_table(std::move(scope->focals));
  return scope;
}

// Of which tool the turn was told, as the recordings say, or the configuration; none: nobody says. Fails where one says
// otherwise.
SetupExpected<std::optional<std::string>> second_sensor_named(const CalibrateScopeOptions& options) {
  std::optional<std::string> tool;
  std::string said_by;
  TrackerConfiguration::Protocol protocol = TrackerConfiguration::Protocol::kNone;
  if (!options.common.configuration.empty()) {
    const auto configuration = load_configuration(options.common.configuration, {}, NamedFiles::kMayBeMissing);
    if (!configuration) return wrong_setup(configuration.error());
    tool = configuration->tracker.second_sensor;
    said_by = options.common.configuration;
    protocol = configuration->tracker.protocol;
  }
  for (const std::vector<std::string>& files : options.setups) {
    const auto own = recorded_handle(files.at(0), kSecondSensorTool);
    if (!own) return tl::unexpected(own.error());
    if (!*own) continue;
    if (tool && !same_tool(*tool, **own, protocol)) {
      return fail(
          fmt::format("{}: its second sensor is \"{}\", and that of {} \"{}\": expected one that stays where it is",
                      files.at(0), **own, said_by, *tool));
    }
    if (!tool) said_by = files.at(0), tool = *own;
  }
  return tool;
}

// Of which sensor the hand-eyes are, as they say, or the configuration; none: nobody says. Fails where one says
// otherwise.
SetupExpected<std::optional<std::string>> sensor_of(const CalibrateScopeOptions& options) {
  std::optional<std::string> sensor;
  std::string said_by;
  TrackerConfiguration::Protocol protocol = TrackerConfiguration::Protocol::kNone;
  if (!options.common.configuration.empty()) {
    const auto configuration = load_configuration(options.common.configuration, {}, NamedFiles::kMayBeMissing);
    if (!configuration) return wrong_setup(configuration.error());
    sensor = configuration->tracker.sensor;
    said_by = options.common.configuration;
    protocol = configuration->tracker.protocol;
  }
  for (const std::vector<std::string>& files : options.setups) {
    const auto own = calibration_fact(files.at(1), "sensor");
    if (!own) continue;
    if (sensor && !same_tool(*sensor, *own, protocol)) {
      return fail(fmt::format("{}: is of the sensor \"{}\", and {} of \"{}\": expected hand-eyes of one sensor",
                              files.at(1), *own, said_by, *sensor));
    }
    if (!sensor) said_by = files.at(1), sensor = own;
  }
  return sensor;
}

SetupExpected<Measurement> measure(const CalibrateScopeOptions& options) {
  Measurement measured{"", nlohmann::json::object(), {}};
  if (!options.setups.empty()) {
    const auto scope = options.by_second_sensor ? scope_by_second_sensor(options) : turned_scope(options);
    if (!scope) return tl::unexpected(scope.error());
    measured.text += text_of(*scope);
    measured.json["turned_scope"] = json_of(*scope);
    // Check and perimapd refuse it with another.
    const auto sensor = sensor_of(options);
    if (!sensor) return tl::unexpected(sensor.error());
    if (*sensor) measured.json["sensor"] = **sensor;
    if (options.by_second_sensor) {
      const auto second = second_sensor_named(options);
      if (!second) return tl::unexpected(second.error());
      if (*second) measured.json["second_sensor"] = **second;
    }
    measured.section = "camera";
    measured.keys = {{"turned_scope", output_key(options.common)}};
    if (options.pictures.empty() && options.recording.empty()) return measured;
  }
  if (options.pictures.empty() == options.recording.empty()) {
    return wrong_setup("expected pictures of the field stop, a recording with --from, or set-ups with --at");
  }
  const auto rotation =
      options.recording.empty() ? rotation_in_pictures(options.pictures) : rotation_in_recording(options.recording);
  if (!rotation) return tl::unexpected(rotation.error());
  measured.text += text_of(*rotation);
  measured.json.update(json_of(*rotation));
  measured.plots = plots_of(*rotation);
  return measured;
}

Outcome run(const CalibrateScopeOptions& options) {
  if (!options.zooms.empty() && options.setups.empty()) {
    return refuse("--zoom: expected --at too, the set-ups at several turns", ExitCode::kWrongUsage);
  }
  if (options.by_second_sensor && (options.setups.empty() || !options.zooms.empty())) {
    return refuse("--by-second-sensor: expected --at, and no --zoom, of which it does not tell", ExitCode::kWrongUsage);
  }
  if (!options.common.configuration.empty() && (options.common.output.empty() || options.setups.empty())) {
    return refuse("--configuration: expected --at and --output too, the file that the configuration is to name",
                  ExitCode::kWrongUsage);
  }
  std::vector<std::string> read = options.inputs();
  for (const auto& named : {options.setups, options.zooms}) {
    for (const auto& files : named) read.insert(read.end(), files.begin(), files.end());
  }
  if (auto able = check_outputs(options.common, read); !able) return able;
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
  command.add_option("IMAGES", options->pictures, "Pictures with the field stop, folders of them, or a video");
  add_from(command, options->recording);
  command
      .add_option_function<std::vector<std::string>>(
          "--at", [options](const std::vector<std::string>& files) { options->setups.push_back(files); },
          "PICTURE HAND_EYE CAMERA: a picture or a recording at one turn of the scope, and what perimap calibrate "
          "hand-eye --output and calibrate camera --output wrote then; give it twice and more, for the set-up as a "
          "function of the turn")
      ->expected(3)
      ->trigger_on_parse();
  command
      .add_option_function<std::vector<std::string>>(
          "--zoom", [options](const std::vector<std::string>& files) { options->zooms.push_back(files); },
          "PICTURE CAMERA: with --at, a picture or a recording at another zoom or focus, and what perimap calibrate "
          "camera --output wrote then: the table of focal lengths by the field stop's radius; between those it is read "
          "along a line")
      ->expected(2)
      ->trigger_on_parse();
  command.add_flag(
      "--by-second-sensor", options->by_second_sensor,
      "With --at, three times and more, each a recording: the turn is told by a second tracked sensor, "
      "recorded as tracker/second_sensor, on the scope where the sensor is on the camera head or the other "
      "way round; the pictures need no field stop, and the zoom must stay as it was");
  add_common(command, options->common, false, true);
}

}  // namespace perimap

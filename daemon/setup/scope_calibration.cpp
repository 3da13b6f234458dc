#include "daemon/setup/scope_calibration.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "core/calibration/fit_by_second_sensor.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/tracked_tools.hpp"
#include "daemon/setup/pictures.hpp"
#include "daemon/setup/recorded_relation.hpp"
#include "daemon/setup/recorded_sensor.hpp"
#include "drivers/calibration/calibration_facts.hpp"
#include "drivers/calibration/calibration_file.hpp"

namespace perimap {
namespace {

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

// The set-up as a function of the rotation, from those at which it was calibrated, where a second sensor tells that.
Expected<TurnedScope> scope_by_second_sensor(const ScopeCalibrationSource& source) {
  std::vector<SetupAtRotation> setups;
  std::vector<HeldRelation> held;
  std::optional<CameraModel> first;
  for (const ScopeAtTurn& files : source.setups) {
    const auto relation = relation_in_recording(files.seen);
    if (!relation) return tl::unexpected(relation.error());
    const auto lens = read_calibration(files.camera);
    if (!lens) return tl::unexpected(lens.error());
    if (!first) first = *lens;
    if (const auto same = same_size(*lens, files.camera, *first); !same) return tl::unexpected(same.error());
    const auto setup = read_setup(files.hand_eye, files.camera);
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

// The set-up as a function of the rotation, from those at which it was calibrated, and of the zoom.
Expected<TurnedScope> turned_scope(const ScopeCalibrationSource& source) {
  std::vector<SetupAtRotation> setups;
  std::optional<CameraModel> first;
  Vector2d turn_px = Vector2d::Zero();
  for (const ScopeAtTurn& files : source.setups) {
    const auto seen = seen_with_lens(files.seen, files.camera);
    if (!seen) return tl::unexpected(seen.error());
    auto setup = read_setup(files.hand_eye, files.camera);
    if (!setup) return tl::unexpected(setup.error());
    if (!first) first = seen->lens;
    if (const auto same = same_size(seen->lens, files.camera, *first); !same) return tl::unexpected(same.error());
    setup->rotation_rad = seen->stop.rotation_rad;
    setup->rotation_deviation_rad = seen->stop.rotation_deviation_rad;
    setup->radius_px = seen->stop.radius_px;
    setups.push_back(*setup);
    turn_px += seen->stop.centre_px / static_cast<double>(source.setups.size());
  }
  auto scope = fit_turned_scope(setups, turn_px);
  if (!scope) return scope;
  scope->width = first->width;
  scope->height = first->height;
  for (const ScopeAtZoom& files : source.zooms) {
    const auto seen = seen_with_lens(files.seen, files.camera);
    if (!seen) return tl::unexpected(seen.error());
    if (const auto same = same_size(seen->lens, files.camera, *first); !same) return tl::unexpected(same.error());
    scope->focals.push_back({seen->stop.radius_px, {seen->lens.fx, seen->lens.fy}});
  }
  scope->focals = focal_table(std::move(scope->focals));
  return scope;
}

// Of which tool the turn was told, as the recordings say, or the configuration; none: nobody says. Fails where one says
// otherwise.
SetupExpected<std::optional<std::string>> second_sensor_named(const ScopeCalibrationSource& source) {
  std::optional<std::string> tool;
  std::string said_by;
  TrackerConfiguration::Protocol protocol = TrackerConfiguration::Protocol::kNone;
  if (!source.configuration.empty()) {
    const auto configuration = load_configuration(source.configuration, {}, NamedFiles::kMayBeMissing);
    if (!configuration) return wrong_setup(configuration.error());
    tool = configuration->tracker.second_sensor;
    said_by = source.configuration;
    protocol = configuration->tracker.protocol;
  }
  for (const ScopeAtTurn& files : source.setups) {
    const auto own = recorded_handle(files.seen, kSecondSensorTool);
    if (!own) return tl::unexpected(own.error());
    if (!*own) continue;
    if (tool && !same_tool(*tool, **own, protocol)) {
      return fail(
          fmt::format("{}: its second sensor is \"{}\", and that of {} \"{}\": expected one that stays where it is",
                      files.seen, **own, said_by, *tool));
    }
    if (!tool) said_by = files.seen, tool = *own;
  }
  return tool;
}

// Of which sensor the hand-eyes are, as they say, or the configuration; none: nobody says. Fails where one says
// otherwise.
SetupExpected<std::optional<std::string>> sensor_of(const ScopeCalibrationSource& source) {
  std::optional<std::string> sensor;
  std::string said_by;
  TrackerConfiguration::Protocol protocol = TrackerConfiguration::Protocol::kNone;
  if (!source.configuration.empty()) {
    const auto configuration = load_configuration(source.configuration, {}, NamedFiles::kMayBeMissing);
    if (!configuration) return wrong_setup(configuration.error());
    sensor = configuration->tracker.sensor;
    said_by = source.configuration;
    protocol = configuration->tracker.protocol;
  }
  for (const ScopeAtTurn& files : source.setups) {
    const auto own = calibration_fact(files.hand_eye, "sensor");
    if (!own) continue;
    if (sensor && !same_tool(*sensor, *own, protocol)) {
      return fail(fmt::format("{}: is of the sensor \"{}\", and {} of \"{}\": expected hand-eyes of one sensor",
                              files.hand_eye, *own, said_by, *sensor));
    }
    if (!sensor) said_by = files.hand_eye, sensor = own;
  }
  return sensor;
}

}  // namespace

SetupExpected<ScopeCalibration> calibrate_scope(const ScopeCalibrationSource& source) {
  ScopeCalibration result;
  if (!source.setups.empty()) {
    auto scope = source.by_second_sensor ? scope_by_second_sensor(source) : turned_scope(source);
    if (!scope) return tl::unexpected(scope.error());
    result.scope = *std::move(scope);
    auto sensor = sensor_of(source);
    if (!sensor) return tl::unexpected(sensor.error());
    result.sensor = *std::move(sensor);
    if (source.by_second_sensor) {
      auto second = second_sensor_named(source);
      if (!second) return tl::unexpected(second.error());
      result.second_sensor = *std::move(second);
    }
    if (source.pictures.empty() && source.recording.empty()) return result;
  }
  if (source.pictures.empty() == source.recording.empty()) {
    return wrong_setup("expected pictures of the field stop, a recording with --from, or set-ups with --at");
  }
  auto rotation =
      source.recording.empty() ? rotation_in_pictures(source.pictures) : rotation_in_recording(source.recording);
  if (!rotation) return tl::unexpected(rotation.error());
  result.rotation = *std::move(rotation);
  return result;
}

}  // namespace perimap

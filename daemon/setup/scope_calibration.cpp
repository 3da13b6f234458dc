#include "daemon/setup/scope_calibration.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <utility>

#include "core/calibration/fit_by_second_sensor.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/tracked_tools.hpp"
#include "daemon/setup/pictures.hpp"
#include "daemon/setup/recorded_poses.hpp"
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

// One set-up of files, its turn by a second sensor or by the field stop.
Expected<MeasuredTurn> measured_turn(const ScopeAtTurn& files, bool by_second_sensor) {
  MeasuredTurn turn;
  std::optional<ScopeRotation> stop;
  if (by_second_sensor) {
    const auto relation = relation_in_recording(files.seen);
    if (!relation) return tl::unexpected(relation.error());
    turn.relation = *relation;
    const auto lens = read_calibration(files.camera);
    if (!lens) return tl::unexpected(lens.error());
    turn.lens = *lens;
  } else {
    auto seen = seen_with_lens(files.seen, files.camera);
    if (!seen) return tl::unexpected(seen.error());
    turn.lens = seen->lens;
    stop = std::move(seen->stop);
  }
  const auto setup = read_setup(files.hand_eye, files.camera);
  if (!setup) return tl::unexpected(setup.error());
  turn.setup = *setup;
  if (!stop) return turn;
  turn.stop_centre_px = stop->centre_px;
  turn.setup.rotation_rad = stop->rotation_rad;
  turn.setup.rotation_deviation_rad = stop->rotation_deviation_rad;
  turn.setup.radius_px = stop->radius_px;
  return turn;
}

Expected<std::vector<MeasuredTurn>> measured_turns(const ScopeCalibrationSource& source) {
  std::vector<MeasuredTurn> turns;
  for (const ScopeAtTurn& files : source.setups) {
    auto turn = measured_turn(files, source.by_second_sensor);
    if (!turn) return tl::unexpected(turn.error());
    if (!turns.empty()) {
      if (const auto same = same_size(turn->lens, files.camera, turns.front().lens); !same) {
        return tl::unexpected(same.error());
      }
    }
    turns.push_back(*std::move(turn));
  }
  return turns;
}

// The set-up as a function of the rotation, from those at which it was calibrated, and of the zoom. `zooms`: of the
// recording.
Expected<TurnedScope> turned_scope(const ScopeCalibrationSource& source, const std::vector<MeasuredTurn>& turns,
                                   const std::vector<RecordedZoom>& zooms) {
  std::vector<SetupAtRotation> setups;
  std::vector<HeldRelation> held;
  Vector2d turn_px = Vector2d::Zero();
  for (const MeasuredTurn& turn : turns) {
    setups.push_back(turn.setup);
    if (turn.relation) held.push_back(*turn.relation);
    if (turn.stop_centre_px) turn_px += *turn.stop_centre_px / static_cast<double>(turns.size());
  }
  auto scope =
      source.by_second_sensor ? fit_by_second_sensor(std::move(setups), held) : fit_turned_scope(setups, turn_px);
  if (!scope) return scope;
  const CameraModel& first = turns.front().lens;
  scope->width = first.width;
  scope->height = first.height;
  for (const ScopeAtZoom& files : source.zooms) {
    const auto seen = seen_with_lens(files.seen, files.camera);
    if (!seen) return tl::unexpected(seen.error());
    if (const auto same = same_size(seen->lens, files.camera, first); !same) return tl::unexpected(same.error());
    scope->focals.push_back({seen->stop.radius_px, {seen->lens.fx, seen->lens.fy}});
  }
  for (const RecordedZoom& zoom : zooms) scope->focals.push_back(zoom.measured);
  scope->focals = focal_table(std::move(scope->focals));
  return scope;
}

// Those of the turns.
std::vector<std::string> recordings_of(const ScopeCalibrationSource& source) {
  if (source.setups.empty()) return {source.recording};
  std::vector<std::string> recordings;
  for (const ScopeAtTurn& files : source.setups) recordings.push_back(files.seen);
  return recordings;
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
  for (const std::string& recording : recordings_of(source)) {
    const auto own = recorded_handle(recording, kSecondSensorTool);
    if (!own) return tl::unexpected(own.error());
    if (!*own) continue;
    if (tool && !same_tool(*tool, **own, protocol)) {
      return fail(
          fmt::format(R"({}: its second sensor is "{}", and that of {} "{}": expected one that stays where it is)",
                      recording, **own, said_by, *tool));
    }
    if (!tool) said_by = recording, tool = *own;
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
    if (source.setups.empty()) return calibrated_sensor(source.recording, *configuration, source.configuration);
  }
  if (source.setups.empty()) return recorded_handle(source.recording, kScopeTool);
  for (const ScopeAtTurn& files : source.setups) {
    const auto own = calibration_fact(files.hand_eye, "sensor");
    if (!own) continue;
    if (sensor && !same_tool(*sensor, *own, protocol)) {
      return fail(fmt::format(R"({}: is of the sensor "{}", and {} of "{}": expected hand-eyes of one sensor)",
                              files.hand_eye, *own, said_by, *sensor));
    }
    if (!sensor) said_by = files.hand_eye, sensor = own;
  }
  return sensor;
}

}  // namespace

SetupExpected<ScopeCalibration> calibrate_scope(
    const ScopeCalibrationSource& source, const std::function<void(std::uint64_t done, std::uint64_t all)>& progress) {
  ScopeCalibration result;
  const bool of_one_recording = source.setups.empty() && source.board.square_mm > 0.0 && !source.recording.empty();
  if (of_one_recording || !source.setups.empty()) {
    std::vector<MeasuredTurn> turns;
    if (of_one_recording) {
      auto recorded = turns_in_recording(source.recording, source.board, source.by_second_sensor, progress);
      if (!recorded) return tl::unexpected(recorded.error());
      for (const RecordedTurn& turn : recorded->turns) turns.push_back(turn.measured);
      result.turns = *std::move(recorded);
    } else {
      auto measured = measured_turns(source);
      if (!measured) return tl::unexpected(measured.error());
      turns = *std::move(measured);
    }
    auto scope = turned_scope(source, turns, result.turns ? result.turns->zooms : std::vector<RecordedZoom>{});
    if (!scope) {
      const std::string told = result.turns ? source.recording + ": " : "";
      const auto& left_out = result.turns ? result.turns->left_out : std::vector<std::string>{};
      return fail(told + scope.error().message +
                  (left_out.empty() ? "" : fmt::format(" (not measured: {})", fmt::join(left_out, "; "))));
    }
    result.scope = *std::move(scope);
    for (const MeasuredTurn& turn : turns) {
      result.setups.push_back(turn.setup);
      if (turn.relation) {
        result.setups.back().rotation_rad = result.scope->second_sensor->rotation_rad(turn.relation->R_S2);
      }
    }
    auto sensor = sensor_of(source);
    if (!sensor) return tl::unexpected(sensor.error());
    result.sensor = *std::move(sensor);
    if (source.by_second_sensor) {
      auto second = second_sensor_named(source);
      if (!second) return tl::unexpected(second.error());
      result.second_sensor = *std::move(second);
    }
    if (of_one_recording || (source.pictures.empty() && source.recording.empty())) return result;
  }
  if (source.pictures.empty() == source.recording.empty()) {
    return wrong_setup(
        "expected pictures of the field stop, a recording with --from, devices with --live, or set-ups "
        "with --at");
  }
  auto rotation =
      source.recording.empty() ? rotation_in_pictures(source.pictures) : rotation_in_recording(source.recording);
  if (!rotation) return tl::unexpected(rotation.error());
  result.rotation = *std::move(rotation);
  return result;
}

}  // namespace perimap

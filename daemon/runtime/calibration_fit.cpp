#include "daemon/runtime/calibration_fit.hpp"

#include <fmt/format.h>

#include <array>
#include <optional>
#include <string_view>
#include <variant>

#include "daemon/config/tracked_tools.hpp"
#include "daemon/runtime/configured_scope.hpp"
#include "daemon/runtime/tool_tips.hpp"
#include "drivers/calibration/calibration_facts.hpp"
#include "drivers/calibration/calibration_file.hpp"
#include "drivers/calibration/tool_tip.hpp"
#include "drivers/calibration/turned_scope_file.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/replay_reader.hpp"
#include "drivers/transport/camera_endpoint.hpp"
#include "drivers/video/video_file.hpp"

namespace perimap {
namespace {

WrongKey wrong(std::string_view key, const std::string& expected, const std::string& got, std::string_view do_next) {
  return {std::string(key), fmt::format("expected {}, got {}: {}", expected, got, do_next)};
}

std::optional<std::string> pointer_fact(const TrackerConfiguration& tracker, const char* key) {
  return tracker.pointer_calibration ? calibration_fact(*tracker.pointer_calibration, key) : std::nullopt;
}

// What the frames must be as large as: the calibration and the turned scope that are named.
struct NamedSizes {
  std::optional<CameraModel> camera;
  std::optional<TurnedScope> scope;
};

// A scope beside a camera's calibration is held against that one (wrong_scope), which is held against these.
WrongKeys scope_of_size(int width, int height, const NamedSizes& named, const std::string& played) {
  const auto& scope = named.scope;
  if (!scope || named.camera || (width == scope->width && height == scope->height)) return {};
  return {wrong("camera.turned_scope", fmt::format("one of pictures of {}x{}, as {} has", width, height, played),
                fmt::format("one of {}x{}", scope->width, scope->height),
                "measure that scope with `perimap calibrate scope`, or play what it was measured of")};
}

WrongKeys of_size(int width, int height, const NamedSizes& named, const std::string& played) {
  WrongKeys all = scope_of_size(width, height, named, played);
  if (const auto& camera = named.camera; camera && (width != camera->width || height != camera->height)) {
    all.push_back(wrong("camera.calibration", fmt::format("one for frames of {}x{}, as {} has", width, height, played),
                        fmt::format("one for {}x{}", camera->width, camera->height),
                        "measure that camera with `perimap calibrate camera`, or play what the calibration is of"));
  }
  return all;
}

WrongKeys wrong_video(const std::string& key, const std::string& file, const NamedSizes& named) {
  auto reader = VideoReader::open(file);
  if (!reader) return {{key, reader.error().message}};
  const auto frame = (*reader)->next();
  if (!frame) return {{key, frame.error().message}};
  if (*frame == nullptr) return {};
  return of_size((*frame)->grey.width, (*frame)->grey.height, named, file);
}

WrongKeys wrong_recording(const std::string& key, const std::string& file, const NamedSizes& named) {
  constexpr std::array<std::string_view, 1> kFrames{channels::kCameraImage};
  auto reader = ReplayReader::open(file, ReadMode::kWhole, kFrames);
  if (!reader) return {{key, reader.error().message}};
  const auto event = reader->next();
  if (!event) return {{key, event.error().message}};
  if (!*event) return {};
  const auto& frame = std::get<FrameEvent>(**event);
  return of_size(frame.width, frame.height, named, file);
}

void warn_of_age(const std::string& what, std::optional<CalibrationDate> made, double most_days, CalibrationDate today,
                 std::string_view anew, std::vector<std::string>& warnings) {
  if (!made || most_days <= 0.0) return;
  const auto days = (today - *made).count();
  if (days < -1) {  // a day more or less may be another part of the world
    warnings.push_back(
        fmt::format("{} of {}: that day is yet to come; is this machine's clock right?", what, date_text(*made)));
  } else if (static_cast<double>(days) > most_days) {
    warnings.push_back(
        fmt::format("{} of {} is {} days old, and setup.maximum_age_days is {:g}; measure it anew with `{}`", what,
                    date_text(*made), days, most_days, anew));
  }
}

std::optional<CalibrationDate> date_of(const std::optional<std::string>& text) {
  return text ? calibration_date_of(*text) : std::nullopt;
}

// The size that the configuration says itself, which is a camera's to deliver.
WrongKeys wrong_size(const CameraConfiguration& c, const NamedSizes& named) {
  if (c.width == 0 || c.height == 0) return {};
  WrongKeys all = scope_of_size(c.width, c.height, named, "the key 'camera.width'");
  if (const auto& camera = named.camera; camera && (c.width != camera->width || c.height != camera->height)) {
    all.push_back(wrong("camera.width", fmt::format("the calibration's {}x{}", camera->width, camera->height),
                        fmt::format("{}x{}", c.width, c.height),
                        "measure the camera with `perimap calibrate camera` as it is used"));
  }
  return all;
}

// Those that can be read; of the others why not is added to what is wrong.
NamedSizes named_sizes(const CameraConfiguration& c, WrongKeys& all) {
  NamedSizes named;
  if (c.calibration) {
    if (auto camera = read_calibration(*c.calibration)) {
      named.camera = *camera;
    } else {
      all.push_back({"camera.calibration", camera.error().message});
    }
  }
  if (c.turned_scope) {
    if (auto scope = read_turned_scope(*c.turned_scope)) {
      named.scope = *std::move(scope);
    } else {
      all.push_back({"camera.turned_scope", scope.error().message});
    }
  }
  return named;
}

// Where a second sensor tells the turn it must be named, and be the one that it was measured of.
WrongKeys wrong_second_sensor(const Configuration& configuration, const TurnedScope& scope) {
  const TrackerConfiguration& tracker = configuration.tracker;
  if (!scope.second_sensor) return {};
  const auto own = calibration_fact(*configuration.camera.turned_scope, "second_sensor");
  const auto& named = tracker.second_sensor;
  if (named && (!own || same_tool(*own, *named, tracker.protocol))) return {};
  // Recorded poses say themselves whether there are such; one that is uploaded is given a handle.
  const bool recorded = tracker.protocol == TrackerConfiguration::Protocol::kNone;
  if (!named && (recorded || second_sensor_of(tracked_tool_names(tracker)))) return {};
  return {wrong("tracker.second_sensor",
                own ? fmt::format("\"{}\", as 'camera.turned_scope' is of", *own)
                    : "the sensor that tells how the scope of 'camera.turned_scope' is turned",
                named ? fmt::format("\"{}\"", *named) : "nothing",
                "name it, or measure the scope with `perimap calibrate scope`")};
}

// Of the camera's picture, and of the tracker's sensor where it says of which it is.
WrongKeys wrong_scope(const Configuration& configuration, const NamedSizes& named) {
  const CameraConfiguration& c = configuration.camera;
  const TrackerConfiguration& tracker = configuration.tracker;
  if (!named.scope) return {};
  WrongKeys all;
  if (named.camera) {
    if (auto scope = configured_scope(configuration, *named.camera); !scope) append(all, std::move(scope.error()));
  }
  append(all, wrong_second_sensor(configuration, *named.scope));
  const auto sensor = calibration_fact(*c.turned_scope, "sensor");
  if (!sensor) return all;
  // Where there is no tracker, a sensor that is named says of which one the recorded poses are.
  if (!tracker.sensor && tracker.protocol == TrackerConfiguration::Protocol::kNone) return all;
  if (tracker.sensor && same_tool(*sensor, *tracker.sensor, tracker.protocol)) return all;
  all.push_back(wrong("camera.turned_scope",
                      tracker.sensor ? fmt::format("one of \"{}\", the tracker.sensor", *tracker.sensor)
                                     : "a tracker.sensor that is named, for it is of one sensor",
                      fmt::format("one of \"{}\"", *sensor),
                      "its hand-eye is that sensor's; name it, or measure the scope with `perimap calibrate scope`"));
  return all;
}

}  // namespace

WrongKeys wrong_calibrations(const Configuration& configuration) {
  const TrackerConfiguration& c = configuration.tracker;
  WrongKeys all;
  const NamedSizes named = named_sizes(configuration.camera, all);
  append(all, wrong_size(configuration.camera, named));
  append(all, wrong_scope(configuration, named));
  if (c.hand_eye_sensor && !c.sensor && c.protocol != TrackerConfiguration::Protocol::kNone) {
    all.push_back(wrong("tracker.sensor", fmt::format("\"{}\", as 'tracker.hand_eye_sensor' says", *c.hand_eye_sensor),
                        "nothing", "without it any other sensor would be taken for that one; name the sensor"));
  }
  if (c.hand_eye_sensor && c.sensor && !same_tool(*c.hand_eye_sensor, *c.sensor, c.protocol)) {
    all.push_back(wrong("tracker.hand_eye_sensor", fmt::format("\"{}\", the tracker.sensor", *c.sensor),
                        fmt::format("\"{}\"", *c.hand_eye_sensor),
                        "the hand-eye is another sensor's; measure it with `perimap calibrate hand-eye`"));
  }
  if (c.pointer_calibration) {
    if (const auto tip = read_tool_tip(*c.pointer_calibration); !tip) {
      all.push_back({"tracker.pointer_calibration", tip.error().message});
    }
  }
  const auto tool = pointer_fact(c, "tool");
  // Recordings have it by its role, which says nothing of which tool it was.
  if (tool && *tool != "pointer" && c.pointer && !same_tool(*tool, *c.pointer, c.protocol)) {
    all.push_back(wrong("tracker.pointer_calibration", fmt::format("one of \"{}\", the tracker.pointer", *c.pointer),
                        fmt::format("one of \"{}\"", *tool),
                        "the tip is another tool's; measure it with `perimap calibrate tool`"));
  }
  append(all, wrong_tips(c));
  return all;
}

WrongKeys wrong_frames(const Configuration& configuration, const std::filesystem::path& configuration_file) {
  const CameraConfiguration& c = configuration.camera;
  WrongKeys unread;
  const NamedSizes named = named_sizes(c, unread);
  if (!named.camera && !named.scope) return unread;
  if (const auto& played = configuration.replay.recording) {
    return wrong_recording("replay.recording", played->string(), named);
  }
  if (c.playback) return wrong_recording("camera.playback", c.playback->string(), named);
  if (!c.device) return unread;
  const auto endpoint = parse_camera_endpoint(*c.device);
  const auto* video = endpoint ? std::get_if<VideoEndpoint>(&*endpoint) : nullptr;
  if (video == nullptr) return unread;
  return wrong_video("camera.device", (configuration_file.parent_path() / video->file).lexically_normal().string(),
                     named);
}

std::vector<std::string> old_calibrations(const Configuration& configuration,
                                          std::chrono::system_clock::time_point now) {
  std::vector<std::string> warnings;
  const auto today = std::chrono::floor<std::chrono::days>(now);
  const TrackerConfiguration& c = configuration.tracker;
  const double most = configuration.setup.maximum_age_days;
  if (configuration.camera.calibration) {
    warn_of_age("camera.calibration: the one", camera_calibration_date(*configuration.camera.calibration), most, today,
                "perimap calibrate camera", warnings);
  }
  if (configuration.camera.turned_scope) {
    warn_of_age("camera.turned_scope: the one", date_of(calibration_fact(*configuration.camera.turned_scope, "date")),
                most, today, "perimap calibrate scope", warnings);
  }
  if (c.protocol == TrackerConfiguration::Protocol::kNone) return warnings;
  warn_of_age("tracker.hand_eye_date: the hand-eye", date_of(c.hand_eye_date), most, today,
              "perimap calibrate hand-eye", warnings);
  warn_of_age("tracker.pointer_calibration: the one", date_of(pointer_fact(c, "date")), most, today,
              "perimap calibrate tool", warnings);
  return warnings;
}

}  // namespace perimap

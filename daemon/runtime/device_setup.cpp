#include "daemon/runtime/device_setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <utility>

#include "daemon/config/ecg_inputs.hpp"
#include "daemon/config/tracked_tools.hpp"
#include "daemon/runtime/calibration_fit.hpp"
#include "daemon/runtime/configured_model.hpp"
#include "daemon/runtime/configured_scope.hpp"
#include "daemon/runtime/tool_tips.hpp"
#include "drivers/calibration/calibration_file.hpp"
#include "drivers/ecg/can_ecg.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/text_file/text_file.hpp"
#include "drivers/transport/camera_endpoint.hpp"
#include "drivers/video/video_file.hpp"

namespace perimap {
namespace {

WrongKey wrong_key(std::string_view key, std::string_view expected, std::string_view got) {
  return {std::string(key), fmt::format("expected {}, got {}", expected, got)};
}

// None: what is wrong is added.
std::optional<Endpoint> endpoint_of(const char* key, const std::optional<std::string>& text, WrongKeys& wrong) {
  if (!text) {
    wrong.push_back(wrong_key(key, "where the device is", "nothing"));
    return std::nullopt;
  }
  auto endpoint = parse_endpoint(*text);
  if (!endpoint) {
    wrong.push_back({key, endpoint.error().message});
    return std::nullopt;
  }
  return *std::move(endpoint);
}

// A file is a few hundred bytes; NDI gives it 1024, rounded up here for later formats.
Expected<std::vector<std::byte>> read_definition(const std::filesystem::path& file) {
  constexpr std::size_t kLargest = 16 * 1024;
  const auto text = read_text_file(file, kLargest, "tool definition");
  if (!text) return tl::unexpected(text.error());
  if (text->empty() || text->size() > kLargest) {
    return fail(fmt::format("{}: expected a tool definition of 1 to {} bytes", file.string(), kLargest));
  }
  const auto bytes = std::as_bytes(std::span(text->data(), text->size()));
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

struct NdiKeys {
  const char* handle;
  const char* definition;
};

NdiTool ndi_tool(const NdiKeys& keys, const std::optional<std::string>& handle,
                 const std::optional<std::filesystem::path>& definition, WrongKeys& wrong) {
  NdiTool tool;
  if (definition) {
    if (auto bytes = read_definition(*definition)) {
      tool.definition = std::move(*bytes);
    } else {
      wrong.push_back({keys.definition, bytes.error().message});
    }
  }
  if (handle) {
    std::uint16_t value = 0;
    const auto [end, error] = std::from_chars(handle->data(), handle->data() + handle->size(), value, 16);
    if (error != std::errc{} || end != handle->data() + handle->size() || handle->size() > 2) {
      wrong.push_back(
          wrong_key(keys.handle, "a port handle of two hexadecimal digits", fmt::format("\"{}\"", *handle)));
    }
    tool.handle = value;
  }
  return tool;
}

NdiSettings ndi_settings(const TrackerConfiguration& c, WrongKeys& wrong) {
  NdiSettings settings;
  settings.sensor = ndi_tool({"tracker.sensor", "tracker.sensor_definition"}, c.sensor, c.sensor_definition, wrong);
  if (c.reference || c.reference_definition) {
    settings.reference =
        ndi_tool({"tracker.reference", "tracker.reference_definition"}, c.reference, c.reference_definition, wrong);
  }
  const auto add = [&settings](std::string name, NdiTool tool) {
    tool.name = std::move(name);
    settings.tools.push_back(std::move(tool));
  };
  if (c.pointer || c.pointer_definition) {
    add("pointer", ndi_tool({"tracker.pointer", "tracker.pointer_definition"}, c.pointer, c.pointer_definition, wrong));
  }
  if (c.second_sensor || c.second_sensor_definition) {
    add("second sensor", ndi_tool({"tracker.second_sensor", "tracker.second_sensor_definition"}, c.second_sensor,
                                  c.second_sensor_definition, wrong));
  }
  if (c.patient_tool || c.patient_tool_definition) {
    add("patient tool", ndi_tool({"tracker.patient_tool", "tracker.patient_tool_definition"}, c.patient_tool,
                                 c.patient_tool_definition, wrong));
  }
  constexpr NdiKeys kInstruments{"tracker.instruments", "tracker.instrument_definitions"};
  for (const std::string& instrument : c.instruments) {
    add("instrument " + instrument, ndi_tool(kInstruments, instrument, std::nullopt, wrong));
  }
  for (const std::filesystem::path& definition : c.instrument_definitions) {
    add("instrument " + definition.stem().string(), ndi_tool(kInstruments, std::nullopt, definition, wrong));
  }
  settings.frame_rate_hz = c.frame_rate_hz;
  return settings;
}

struct FrameSize {
  int width = 0;
  int height = 0;
};

// Of the keys or of the calibration, which must agree; zeros when neither says.
FrameSize frame_size(const CameraConfiguration& c, WrongKeys& wrong) {
  const FrameSize given{c.width, c.height};
  if ((c.width > 0) != (c.height > 0)) {
    wrong.push_back(wrong_key(c.width > 0 ? "camera.height" : "camera.width", "one, since the other is given", "0"));
    return given;
  }
  if (!c.calibration) return given;
  const auto calibration = read_calibration(*c.calibration);
  if (!calibration) {
    wrong.push_back({"camera.calibration", calibration.error().message});
    return given;
  }
  if (c.width > 0 && (c.width != calibration->width || c.height != calibration->height)) {
    wrong.push_back(wrong_key("camera.width",
                              fmt::format("the calibration's {}x{}", calibration->width, calibration->height),
                              fmt::format("{}x{}", c.width, c.height)));
  }
  return {calibration->width, calibration->height};
}

V4l2Settings v4l2_settings(const CameraConfiguration& c, const std::string& path, const FrameSize& size) {
  V4l2Settings settings;
  settings.path = path;
  settings.format = c.format;
  settings.width = size.width;
  settings.height = size.height;
  settings.input = c.input;
  settings.frame_rate_hz = c.frame_rate_hz;
  settings.exposure_ms = c.exposure_ms;
  settings.gain = c.gain;
  settings.delay = c.delay;
  return settings;
}

Expected<CameraPlayback> camera_playback(const std::string& recording, double start_s) {
  std::optional<Duration> offset;
  if (start_s > 0.0) {
    auto whole = ReplayReader::open(recording, ReadMode::kStrict);
    if (!whole) return tl::unexpected(std::move(whole.error()));
    const auto first = whole->next();
    if (!first) return tl::unexpected(first.error());
    if (*first) offset = Instant(from_seconds(start_s)) - arrival_of(**first);
  }
  constexpr std::array<std::string_view, 1> kFrames{channels::kCameraImage};
  auto reader = ReplayReader::open(recording, ReadMode::kStrict, kFrames);
  if (!reader) return tl::unexpected(std::move(reader.error()));
  return CameraPlayback{std::move(*reader), offset};
}

}  // namespace

bool names_devices(const Configuration& configuration) noexcept {
  return configuration.tracker.protocol != TrackerConfiguration::Protocol::kNone ||
         configuration.ecg.protocol != EcgConfiguration::Protocol::kNone || configuration.camera.playback.has_value() ||
         configuration.camera.device.has_value() || configuration.ecg.r_trigger_port.has_value();
}

tl::expected<TrackerDevice, WrongKeys> tracker_device(const TrackerConfiguration& c) {
  if (c.protocol == TrackerConfiguration::Protocol::kNone) {
    return tl::unexpected(WrongKeys{wrong_key("tracker.protocol", R"("ndi" or "igtl")", R"("none")")});
  }
  WrongKeys wrong;
  auto endpoint = endpoint_of("tracker.port", c.port, wrong);
  if (endpoint && std::holds_alternative<CanEndpoint>(*endpoint)) {
    wrong.push_back(wrong_key("tracker.port", "a serial port or tcp:HOST:PORT", format_endpoint(*endpoint)));
  }
  const double(&t)[3] = c.translation_IW_mm;
  WorldSettings world;
  world.X_IW = pose_from_wxyz(Vector3d(t[0], t[1], t[2]), c.rotation_IW_wxyz);
  // A tool seen from itself stands still where it is: a pose that looks well and says nothing.
  if (const auto twice = tool_named_twice(c)) {
    wrong.push_back(
        wrong_key(twice->key, fmt::format("another tool than '{}'", twice->also), fmt::format("\"{}\"", twice->tool)));
  }
  if (c.protocol == TrackerConfiguration::Protocol::kIgtl) {
    if (!wrong.empty()) return tl::unexpected(std::move(wrong));
    IgtlSettings settings{c.sensor.value_or(""), c.reference, world, {}};
    settings.stamps_by_arrival = c.igtl_stamps_by_arrival;
    if (c.pointer) settings.tools.push_back(*c.pointer);
    if (c.second_sensor) settings.tools.push_back(*c.second_sensor);
    if (c.patient_tool) settings.tools.push_back(*c.patient_tool);
    settings.tools.insert(settings.tools.end(), c.instruments.begin(), c.instruments.end());
    return TrackerDevice{std::move(*endpoint), std::move(settings), tracked_tool_names(c)};
  }
  NdiSettings settings = ndi_settings(c, wrong);
  if (!wrong.empty()) return tl::unexpected(std::move(wrong));
  settings.world = world;
  return TrackerDevice{std::move(*endpoint), std::move(settings), tracked_tool_names(c)};
}

tl::expected<EcgDevice, WrongKeys> ecg_device(const Configuration& configuration) {
  const EcgConfiguration& c = configuration.ecg;
  using Protocol = EcgConfiguration::Protocol;
  if (c.protocol == Protocol::kNone) {
    return tl::unexpected(WrongKeys{wrong_key("ecg.protocol", "an ECG device", "\"none\"")});
  }
  WrongKeys wrong;
  auto endpoint = endpoint_of("ecg.port", c.port, wrong);
  if (endpoint && std::holds_alternative<CanEndpoint>(*endpoint) != (c.protocol == Protocol::kCan)) {
    wrong.push_back(wrong_key("ecg.port",
                              c.protocol == Protocol::kCan ? "can:INTERFACE" : "a serial port or tcp:HOST:PORT",
                              format_endpoint(*endpoint)));
  }
  for (const WrongInput& input : wrong_inputs(configuration)) {
    wrong.push_back(wrong_key(fmt::format("{}.{}", input.section, input.key), input.expected, input.got));
  }
  constexpr std::uint32_t kLargest = CanEcgSettings::kLargestStandardIdentifier;
  if (!c.can_extended && static_cast<std::uint32_t>(c.can_identifier) > kLargest) {
    wrong.push_back(wrong_key("ecg.can_identifier", fmt::format("at most {} with 11 bits", kLargest),
                              fmt::format("{}", c.can_identifier)));
  }
  if (!wrong.empty()) return tl::unexpected(std::move(wrong));
  return EcgDevice{std::move(*endpoint), c, configuration.respiration.device_channel};
}

tl::expected<RTriggerDevice, WrongKeys> r_trigger_device(const EcgConfiguration& c) {
  if (!c.r_trigger_port) {
    return tl::unexpected(
        WrongKeys{wrong_key("ecg.r_trigger_port", "the serial port with the trigger's line", "nothing")});
  }
  RTriggerDevice device;
  device.settings.path = *c.r_trigger_port;
  device.settings.line = c.r_trigger_line;
  device.settings.rising = c.r_trigger_rising;
  return device;
}

tl::expected<CameraDevice, WrongKeys> camera_device(const CameraConfiguration& c,
                                                    const std::filesystem::path& configuration_file) {
  WrongKeys wrong;
  if (c.device && c.playback) {
    wrong.push_back(wrong_key("camera.playback", "nothing beside 'camera.device'", c.playback->string()));
  } else if (c.playback) {
    auto playback = camera_playback(c.playback->string(), c.playback_start_s);
    if (playback) return CameraDevice(*std::move(playback));
    wrong.push_back({"camera.playback", playback.error().message});
  }
  if (!c.device && !c.playback) {
    wrong.push_back(wrong_key("camera.device", "a camera, or a recording in 'camera.playback'", "nothing"));
  }
  if (!c.device) return tl::unexpected(std::move(wrong));
  const FrameSize size = frame_size(c, wrong);
  const auto endpoint = parse_camera_endpoint(*c.device);
  if (!endpoint) wrong.push_back({"camera.device", endpoint.error().message});
  const auto* video = endpoint ? std::get_if<VideoEndpoint>(&*endpoint) : nullptr;
  const std::filesystem::path file =
      video != nullptr ? (configuration_file.parent_path() / video->file).lexically_normal() : "";
  std::error_code code;
  if (video != nullptr && !std::filesystem::is_regular_file(file, code)) {
    wrong.push_back(wrong_key("camera.device", "a video file", fmt::format("{}, which is not there", file.string())));
  }
  if (!wrong.empty()) return tl::unexpected(std::move(wrong));
  if (video != nullptr) return VideoCameraSettings{file.string(), c.frame_rate_hz, c.loop, size.width, size.height};
  return v4l2_settings(c, std::get<V4l2Endpoint>(*endpoint).path, size);
}

tl::expected<Devices, WrongKeys> named_devices(const Configuration& configuration,
                                               const std::filesystem::path& configuration_file) {
  Devices devices;
  WrongKeys wrong;
  const auto keep = [&wrong](auto device, auto& place) {
    if (device) {
      place.emplace(*std::move(device));
    } else {
      append(wrong, std::move(device.error()));
    }
  };
  if (configuration.tracker.protocol != TrackerConfiguration::Protocol::kNone) {
    keep(tracker_device(configuration.tracker), devices.tracker);
  }
  if (configuration.ecg.protocol != EcgConfiguration::Protocol::kNone) keep(ecg_device(configuration), devices.ecg);
  if (configuration.ecg.r_trigger) keep(r_trigger_device(configuration.ecg), devices.r_trigger);
  if (configuration.camera.device || configuration.camera.playback) {
    keep(camera_device(configuration.camera, configuration_file), devices.camera);
  }
  if (!wrong.empty()) return tl::unexpected(std::move(wrong));
  return devices;
}

namespace {

// What a map takes and the configuration does not name: camera, tracker, and R peaks by ECG or trigger.
WrongKeys missing_devices(const Configuration& configuration) {
  WrongKeys missing;
  if (configuration.tracker.protocol == TrackerConfiguration::Protocol::kNone) {
    append(missing, tracker_device(configuration.tracker).error());
  }
  if (configuration.ecg.protocol == EcgConfiguration::Protocol::kNone && !configuration.ecg.r_trigger) {
    append(missing, ecg_device(configuration).error());
  }
  const CameraConfiguration& camera = configuration.camera;
  if (!camera.device && !camera.playback) append(missing, camera_device(camera, "").error());
  return missing;
}

// The camera, hand-eye and scope that a session begins with. Of what cannot be read it is told elsewhere why
// (wrong_calibrations).
RecordedBasis basis_of_file(const Configuration& given, WrongKeys& wrong) {
  RecordedBasis basis;
  basis.configuration = given;
  if (given.camera.device && !given.camera.calibration) {
    wrong.push_back(wrong_key("camera.calibration", "the camera's calibration", "nothing"));
  }
  if (!given.camera.calibration) return basis;
  const auto calibration = read_calibration(*given.camera.calibration);
  if (!calibration) return basis;
  basis.camera = *calibration;
  if (const auto scope = configured_scope(given, basis.camera)) basis.turned_scope = *scope;
  return basis;
}

}  // namespace

tl::expected<DeviceSetup, SetupError> prepare_devices(const std::filesystem::path& configuration_file,
                                                      const Configuration& given) {
  WrongKeys wrong;
  RecordedBasis basis;
  if (given.camera.playback) {
    // The recording brings its camera's calibration and hand-eye along.
    auto recorded = recorded_basis(given.camera.playback->string(), configuration_file, ReadMode::kStrict);
    if (!recorded) return tl::unexpected(std::move(recorded.error()));
    basis = std::move(*recorded);
  } else {
    basis = basis_of_file(given, wrong);
  }
  Configuration& configuration = basis.configuration;
  append(wrong, wrong_calibrations(configuration));
  const bool by_second = basis.turned_scope && basis.turned_scope->second_sensor;
  if (by_second && !second_sensor_of(tracked_tool_names(configuration.tracker)) &&
      std::none_of(wrong.begin(), wrong.end(),
                   [](const WrongKey& one) { return one.key == "tracker.second_sensor"; })) {
    wrong.push_back(
        wrong_key("tracker.second_sensor", "the sensor that tells how the turned scope is turned", "nothing"));
  }
  auto devices = named_devices(configuration, configuration_file);
  if (!devices) append(wrong, std::move(devices.error()));
  append(wrong, missing_devices(configuration));
  auto model = configured_model(configuration.model);
  if (!model) append(wrong, std::move(model.error()));
  if (!wrong.empty()) return wrong_setup(told_in(configuration_file, std::move(wrong)));
  if (auto* playback = std::get_if<CameraPlayback>(&*devices->camera)) {
    playback->reader.require_frame_size(basis.camera.width, basis.camera.height);
  }
  if (std::holds_alternative<VideoCameraSettings>(*devices->camera)) {
    if (auto loaded = load_video_support(); !loaded) return tl::unexpected(std::move(loaded.error()));
  }
  PipelineSettings pipeline = pipeline_settings(configuration, basis.camera);
  pipeline.turned_scope = basis.turned_scope;
  pipeline.organ_model = *std::move(model);
  const Identity identity{configuration.source.name, first_stream(pipeline), configuration.source.world_frame};
  auto tools = watched_tools(devices->tracker->tools, configuration.tracker);
  return DeviceSetup{std::move(configuration), pipeline, identity, std::move(*devices), std::move(tools)};
}

}  // namespace perimap

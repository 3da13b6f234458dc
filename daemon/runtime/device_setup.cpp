#include "daemon/runtime/device_setup.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cstdint>
#include <utility>

#include "daemon/config/ecg_inputs.hpp"
#include "daemon/config/tracked_tools.hpp"
#include "daemon/runtime/calibration_fit.hpp"
#include "daemon/runtime/configured_scope.hpp"
#include "drivers/calibration/calibration_file.hpp"
#include "drivers/ecg/can_ecg.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/text_file/text_file.hpp"
#include "drivers/transport/camera_endpoint.hpp"
#include "drivers/video/video_file.hpp"

namespace perimap {
namespace {

tl::unexpected<Error> wrong(std::string_view key, std::string_view expected, std::string_view got) {
  return fail(fmt::format("key '{}': expected {}, got {}", key, expected, got));
}

Expected<Endpoint> endpoint_of(std::string_view key, const std::optional<std::string>& text) {
  if (!text) return wrong(key, "where the device is", "nothing");
  return parse_endpoint(*text);
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

Expected<NdiTool> ndi_tool(std::string_view key, const std::optional<std::string>& handle,
                           const std::optional<std::filesystem::path>& definition) {
  NdiTool tool;
  if (definition) {
    auto bytes = read_definition(*definition);
    if (!bytes) return tl::unexpected(std::move(bytes.error()));
    tool.definition = std::move(*bytes);
  }
  if (handle) {
    std::uint16_t value = 0;
    const auto [end, error] = std::from_chars(handle->data(), handle->data() + handle->size(), value, 16);
    if (error != std::errc{} || end != handle->data() + handle->size() || handle->size() > 2) {
      return wrong(key, "a port handle of two hexadecimal digits", fmt::format("\"{}\"", *handle));
    }
    tool.handle = value;
  }
  return tool;
}

// A tool seen from itself stands still where it is: a pose that looks well and says nothing.
tl::unexpected<Error> refuse_twice(const ToolTwice& twice) {
  return wrong(twice.key, fmt::format("another tool than '{}'", twice.also), fmt::format("\"{}\"", twice.tool));
}

Expected<NdiSettings> ndi_settings(const TrackerConfiguration& c) {
  NdiSettings settings;
  auto sensor = ndi_tool("tracker.sensor", c.sensor, c.sensor_definition);
  if (!sensor) return tl::unexpected(std::move(sensor.error()));
  settings.sensor = std::move(*sensor);
  if (c.reference || c.reference_definition) {
    auto reference = ndi_tool("tracker.reference", c.reference, c.reference_definition);
    if (!reference) return tl::unexpected(std::move(reference.error()));
    settings.reference = std::move(*reference);
  }
  const auto add = [&settings](std::string name) {
    return [&settings, name = std::move(name)](NdiTool tool) mutable {
      tool.name = std::move(name);
      settings.tools.push_back(std::move(tool));
    };
  };
  Expected<void> added;
  if (c.pointer || c.pointer_definition) {
    added = ndi_tool("tracker.pointer", c.pointer, c.pointer_definition).map(add("pointer"));
  }
  if (added && (c.second_sensor || c.second_sensor_definition)) {
    added = ndi_tool("tracker.second_sensor", c.second_sensor, c.second_sensor_definition).map(add("second sensor"));
  }
  for (const std::string& instrument : c.instruments) {
    if (added) added = ndi_tool("tracker.instruments", instrument, std::nullopt).map(add("instrument " + instrument));
  }
  for (const std::filesystem::path& definition : c.instrument_definitions) {
    if (!added) break;
    added = ndi_tool("tracker.instrument_definitions", std::nullopt, definition)
                .map(add("instrument " + definition.stem().string()));
  }
  if (!added) return tl::unexpected(std::move(added.error()));
  settings.frame_rate_hz = c.frame_rate_hz;
  return settings;
}

struct FrameSize {
  int width = 0;
  int height = 0;
};

// Of the keys or of the calibration, which must agree; zeros when neither says.
Expected<FrameSize> frame_size(const CameraConfiguration& c) {
  if ((c.width > 0) != (c.height > 0)) {
    return wrong(c.width > 0 ? "camera.height" : "camera.width", "one, since the other is given", "0");
  }
  if (!c.calibration) return FrameSize{c.width, c.height};
  const auto calibration = read_calibration(*c.calibration);
  if (!calibration) return tl::unexpected(calibration.error());
  if (c.width > 0 && (c.width != calibration->width || c.height != calibration->height)) {
    return wrong("camera.width", fmt::format("the calibration's {}x{}", calibration->width, calibration->height),
                 fmt::format("{}x{}", c.width, c.height));
  }
  return FrameSize{calibration->width, calibration->height};
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

Expected<TrackerDevice> tracker_device(const TrackerConfiguration& c) {
  if (c.protocol == TrackerConfiguration::Protocol::kNone)
    return wrong("tracker.protocol", R"("ndi" or "igtl")", R"("none")");
  auto endpoint = endpoint_of("tracker.port", c.port);
  if (!endpoint) return tl::unexpected(std::move(endpoint.error()));
  if (std::holds_alternative<CanEndpoint>(*endpoint)) {
    return wrong("tracker.port", "a serial port or tcp:HOST:PORT", format_endpoint(*endpoint));
  }
  const double(&t)[3] = c.translation_IW_mm;
  WorldSettings world;
  world.X_IW = pose_from_wxyz(Vector3d(t[0], t[1], t[2]), c.rotation_IW_wxyz);
  if (const auto twice = tool_named_twice(c)) return refuse_twice(*twice);
  if (c.protocol == TrackerConfiguration::Protocol::kIgtl) {
    IgtlSettings settings{c.sensor.value_or(""), c.reference, world, {}};
    settings.stamps_by_arrival = c.igtl_stamps_by_arrival;
    if (c.pointer) settings.tools.push_back(*c.pointer);
    if (c.second_sensor) settings.tools.push_back(*c.second_sensor);
    settings.tools.insert(settings.tools.end(), c.instruments.begin(), c.instruments.end());
    return TrackerDevice{std::move(*endpoint), std::move(settings), tracked_tool_names(c)};
  }
  auto settings = ndi_settings(c);
  if (!settings) return tl::unexpected(std::move(settings.error()));
  settings->world = world;
  return TrackerDevice{std::move(*endpoint), std::move(*settings), tracked_tool_names(c)};
}

Expected<EcgDevice> ecg_device(const Configuration& configuration) {
  const EcgConfiguration& c = configuration.ecg;
  using Protocol = EcgConfiguration::Protocol;
  if (c.protocol == Protocol::kNone) return wrong("ecg.protocol", "an ECG device", "\"none\"");
  auto endpoint = endpoint_of("ecg.port", c.port);
  if (!endpoint) return tl::unexpected(std::move(endpoint.error()));
  if (std::holds_alternative<CanEndpoint>(*endpoint) != (c.protocol == Protocol::kCan)) {
    return wrong("ecg.port", c.protocol == Protocol::kCan ? "can:INTERFACE" : "a serial port or tcp:HOST:PORT",
                 format_endpoint(*endpoint));
  }
  if (const auto input = wrong_input(configuration)) {
    return wrong(fmt::format("{}.{}", input->section, input->key), input->expected, input->got);
  }
  constexpr std::uint32_t kLargest = CanEcgSettings::kLargestStandardIdentifier;
  if (!c.can_extended && static_cast<std::uint32_t>(c.can_identifier) > kLargest) {
    return wrong("ecg.can_identifier", fmt::format("at most {} with 11 bits", kLargest),
                 fmt::format("{}", c.can_identifier));
  }
  return EcgDevice{std::move(*endpoint), c, configuration.respiration.device_channel};
}

Expected<RTriggerDevice> r_trigger_device(const EcgConfiguration& c) {
  if (!c.r_trigger_port) return wrong("ecg.r_trigger_port", "the serial port with the trigger's line", "nothing");
  RTriggerDevice device;
  device.settings.path = *c.r_trigger_port;
  device.settings.line = c.r_trigger_line;
  device.settings.rising = c.r_trigger_rising;
  return device;
}

Expected<CameraDevice> camera_device(const CameraConfiguration& c, const std::filesystem::path& configuration_file) {
  if (c.device && c.playback) return wrong("camera.playback", "nothing beside 'camera.device'", c.playback->string());
  if (c.playback) {
    return camera_playback(c.playback->string(), c.playback_start_s).map([](CameraPlayback playback) {
      return CameraDevice(std::move(playback));
    });
  }
  if (!c.device) return wrong("camera.device", "a camera, or a recording in 'camera.playback'", "nothing");
  const auto endpoint = parse_camera_endpoint(*c.device);
  if (!endpoint) return tl::unexpected(endpoint.error());
  const auto size = frame_size(c);
  if (!size) return tl::unexpected(size.error());
  if (const auto* v4l2 = std::get_if<V4l2Endpoint>(&*endpoint)) return v4l2_settings(c, v4l2->path, *size);
  const std::filesystem::path file =
      (configuration_file.parent_path() / std::get<VideoEndpoint>(*endpoint).file).lexically_normal();
  std::error_code code;
  if (!std::filesystem::is_regular_file(file, code)) {
    return wrong("camera.device", "a video file", fmt::format("{}, which is not there", file.string()));
  }
  return VideoCameraSettings{file.string(), c.frame_rate_hz, c.loop, size->width, size->height};
}

Expected<Devices> named_devices(const Configuration& configuration, const std::filesystem::path& configuration_file) {
  Devices devices;
  const auto keep = [](auto& place) { return [&place](auto device) { place.emplace(std::move(device)); }; };
  Expected<void> named;
  if (configuration.tracker.protocol != TrackerConfiguration::Protocol::kNone) {
    named = tracker_device(configuration.tracker).map(keep(devices.tracker));
  }
  if (named && configuration.ecg.protocol != EcgConfiguration::Protocol::kNone) {
    named = ecg_device(configuration).map(keep(devices.ecg));
  }
  if (named && configuration.ecg.r_trigger) {
    named = r_trigger_device(configuration.ecg).map(keep(devices.r_trigger));
  }
  if (named && (configuration.camera.device || configuration.camera.playback)) {
    named = camera_device(configuration.camera, configuration_file).map(keep(devices.camera));
  }
  if (!named) return tl::unexpected(std::move(named.error()));
  return devices;
}

tl::expected<DeviceSetup, SetupError> prepare_devices(const std::filesystem::path& configuration_file,
                                                      const Configuration& given) {
  const auto wrong_configuration = [&configuration_file](const Error& error) {
    return tl::unexpected(SetupError{{fmt::format("{}: {}", configuration_file.string(), error.message)}, true});
  };
  RecordedBasis basis;
  if (given.camera.playback) {
    // The recording brings its camera's calibration and hand-eye along.
    auto recorded = recorded_basis(given.camera.playback->string(), configuration_file, ReadMode::kStrict);
    if (!recorded) return tl::unexpected(std::move(recorded.error()));
    basis = std::move(*recorded);
  } else {
    basis.configuration = given;
    if (given.camera.device && !given.camera.calibration) {
      return wrong_configuration({"key 'camera.calibration': expected the camera's calibration, got nothing"});
    }
    if (given.camera.calibration) {
      const auto calibration = read_calibration(*given.camera.calibration);
      if (!calibration) return tl::unexpected(SetupError{calibration.error(), true});
      basis.camera = *calibration;
    }
    auto scope = configured_scope(given, basis.camera);
    if (!scope) return wrong_configuration(scope.error());
    basis.turned_scope = *scope;
  }
  Configuration& configuration = basis.configuration;
  const bool by_second = basis.turned_scope && basis.turned_scope->second_sensor;
  if (by_second && !second_sensor_of(tracked_tool_names(configuration.tracker))) {
    return wrong_configuration(
        {"key 'tracker.second_sensor': expected the sensor that tells how the turned scope is turned, got nothing"});
  }
  if (const auto fits = calibrations_fit(configuration); !fits) return wrong_configuration(fits.error());
  auto devices = named_devices(configuration, configuration_file);
  // A map takes camera, tracker and R peaks: one that is not named is asked for as it would be.
  if (devices && !devices->tracker) devices = tl::unexpected(tracker_device(configuration.tracker).error());
  if (devices && !devices->ecg && !devices->r_trigger) devices = tl::unexpected(ecg_device(configuration).error());
  if (devices && !devices->camera) {
    devices = tl::unexpected(camera_device(configuration.camera, configuration_file).error());
  }
  if (!devices) return wrong_configuration(devices.error());
  if (auto* playback = std::get_if<CameraPlayback>(&*devices->camera)) {
    playback->reader.require_frame_size(basis.camera.width, basis.camera.height);
  }
  if (std::holds_alternative<VideoCameraSettings>(*devices->camera)) {
    if (auto loaded = load_video_support(); !loaded)
      return tl::unexpected(SetupError{std::move(loaded.error()), false});
  }
  PipelineSettings pipeline = pipeline_settings(configuration, basis.camera);
  pipeline.turned_scope = basis.turned_scope;
  const Identity identity{configuration.source.name, first_stream(pipeline), configuration.source.world_frame};
  return DeviceSetup{std::move(configuration), pipeline, identity, std::move(*devices)};
}

}  // namespace perimap

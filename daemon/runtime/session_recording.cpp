#include "daemon/runtime/session_recording.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <string>
#include <system_error>
#include <utility>

#include "daemon/config/configuration_loader.hpp"
#include "daemon/runtime/utc_offset.hpp"
#include "drivers/calibration/calibration_file.hpp"

namespace perimap {

std::filesystem::path recording_path(const std::filesystem::path& folder, std::chrono::system_clock::time_point now) {
  const std::string name =
      fmt::format("perimap-{:%Y%m%d-%H%M%S}", fmt::gmtime(std::chrono::system_clock::to_time_t(now)));
  std::filesystem::path path = folder / (name + ".mcap");
  std::error_code ignored;
  for (int n = 2; std::filesystem::exists(path, ignored); ++n) path = folder / fmt::format("{}-{}.mcap", name, n);
  return path;
}

SensorRecordingFacts recording_facts(const Configuration& configuration, const std::optional<CameraModel>& camera,
                                     std::string generator) {
  Configuration for_replay = configuration;
  for_replay.camera = {};
  for_replay.ecg = {};
  for_replay.ecg.r_trigger = configuration.ecg.r_trigger;
  for_replay.ecg.r_trigger_delay = configuration.ecg.r_trigger_delay;
  for_replay.ecg.r_trigger_deviation = configuration.ecg.r_trigger_deviation;
  for_replay.respiration.device_channel = 0;
  for_replay.replay = {};
  for_replay.recording = {};
  TrackerConfiguration& tracker = for_replay.tracker;
  const TrackerConfiguration none;
  tracker.protocol = none.protocol;
  tracker.port.reset();
  tracker.sensor.reset();
  tracker.reference.reset();
  tracker.sensor_definition.reset();
  tracker.reference_definition.reset();
  std::copy(std::begin(none.translation_IW_mm), std::end(none.translation_IW_mm), tracker.translation_IW_mm);
  std::copy(std::begin(none.rotation_IW_wxyz), std::end(none.rotation_IW_wxyz), tracker.rotation_IW_wxyz);

  SensorRecordingFacts facts;
  facts.generator = std::move(generator);
  facts.description = "recorded from devices";
  facts.world_frame = configuration.source.world_frame;
  facts.utc_minus_monotonic = utc_minus_monotonic();
  if (camera) facts.calibration = format_calibration(*camera);
  facts.configuration = to_toml(for_replay);
  facts.r_trigger = configuration.ecg.r_trigger;
  facts.respiration = configuration.respiration.device_channel > 0;
  return facts;
}

}  // namespace perimap

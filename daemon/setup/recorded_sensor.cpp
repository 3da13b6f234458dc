#include "daemon/setup/recorded_sensor.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/tracked_tools.hpp"
#include "daemon/setup/recorded_poses.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {

Expected<std::optional<std::string>> recorded_handle(const std::string& recording, const std::string& tool) {
  auto reader = RecordingReader::open(recording);
  if (!reader) return tl::unexpected(reader.error());
  const auto names = reader->attachment_names();
  if (std::find(names.begin(), names.end(), attachments::kConfiguration) == names.end()) return std::nullopt;
  const auto text = reader->attachment(attachments::kConfiguration);
  if (!text) return tl::unexpected(text.error());
  const auto recorded = parse_recorded_configuration(
      *text, fmt::format("{}:{}", recording, attachments::kConfiguration), {}, OtherKeys::kPassedOver);
  if (!recorded) return tl::unexpected(recorded.error());
  const TrackerConfiguration& tracker = recorded->configuration.tracker;
  if (tool == kScopeTool) return tracker.sensor;
  if (tool == "pointer") return tracker.pointer;
  if (tool == kSecondSensorTool) return tracker.second_sensor;
  return std::nullopt;
}

Expected<std::optional<std::string>> calibrated_sensor(const std::string& recording, const Configuration& configuration,
                                                       const std::string& file) {
  auto recorded = recorded_handle(recording, kScopeTool);
  const std::optional<std::string>& named = configuration.tracker.sensor;
  if (!recorded || !named) return recorded;
  if (!*recorded || same_tool(**recorded, *named, configuration.tracker.protocol)) return named;
  return fail(fmt::format(
      "{}: is of the sensor \"{}\", and tracker.sensor of {} is \"{}\": what is measured of one does not hold for the "
      "other; name that sensor, or record the other one",
      recording, **recorded, file, *named));
}

}  // namespace perimap

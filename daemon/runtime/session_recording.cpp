#include "daemon/runtime/session_recording.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <string>
#include <system_error>
#include <utility>

#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/configuration_text.hpp"
#include "daemon/config/tracked_tools.hpp"
#include "daemon/runtime/tool_tips.hpp"
#include "daemon/runtime/utc_offset.hpp"
#include "drivers/calibration/calibration_file.hpp"
#include "drivers/calibration/tool_tip.hpp"
#include "drivers/recording/channels.hpp"

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
  SensorRecordingFacts facts;
  facts.generator = std::move(generator);
  facts.description = "recorded from devices";
  facts.world_frame = configuration.source.world_frame;
  facts.readers = configuration.recording.group.value_or("");
  facts.utc_minus_monotonic = utc_minus_monotonic();
  if (camera) facts.calibration = format_calibration(*camera);
  Configuration session = configuration;
  // Of the recording nobody can tell any more that it was a video.
  session.camera.repeats_allowed |= configuration.camera.plays_video_in_loop();
  facts.configuration = session_toml(session);
  facts.r_trigger = configuration.ecg.r_trigger;
  const std::vector<std::string> names = tracked_tool_names(configuration.tracker);
  for (const std::string& tool : names) {
    facts.tools.push_back(tool.empty() ? tool : std::string(channels::kTrackedTools) + tool);
  }
  for (const WatchedTool& tool : watched_tools(names, configuration.tracker)) {
    if (!tool.tip) continue;
    facts.tips.emplace_back(tool.name, format_tool_tip({tool.tip->p_OT_mm, tool.tip->covariance_O_mm2}, tool.name));
  }
  facts.second_lead = configuration.ecg.second_channel > 0;
  facts.respiration = configuration.respiration.device_channel > 0;
  return facts;
}

}  // namespace perimap

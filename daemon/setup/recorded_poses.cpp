#include "daemon/setup/recorded_poses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "core/time/instant.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/recording_reader.hpp"
#include "drivers/recording/topic.hpp"
#include "drivers/recording/tracker_samples.hpp"

namespace perimap {
namespace {

// The tools whose poses there are, for messages.
std::string tools_of(const RecordingReader& reader) {
  std::string tools;
  for (const RecordedChannel& channel : reader.channels()) {
    std::string_view name = channel.name;
    if (channel.type != topic_type<perimap_TrackerPose>().schema_name()) continue;
    if (name.starts_with(channels::kTrackedTools)) name.remove_prefix(channels::kTrackedTools.size());
    if (channel.name == channels::kTrackerPose) name = kScopeTool;
    tools += fmt::format("{}{}", tools.empty() ? "" : ", ", name);
  }
  return tools.empty() ? "of no tool" : tools;
}

std::string channel_of(const std::string& tool) {
  return tool == kScopeTool ? std::string(channels::kTrackerPose) : std::string(channels::kTrackedTools) + tool;
}

bool has_channel(const RecordingReader& reader, const std::string& channel) {
  const auto recorded = reader.channels();
  return std::any_of(recorded.begin(), recorded.end(), [&](const RecordedChannel& c) { return c.name == channel; });
}

}  // namespace

Expected<bool> has_recorded_poses(const std::string& recording, const std::string& tool) {
  return RecordingReader::open(recording).map(
      [&](const RecordingReader& reader) { return has_channel(reader, channel_of(tool)); });
}

Expected<std::vector<TimedPose>> read_recorded_poses(const std::string& recording, const std::string& tool) {
  auto reader = RecordingReader::open(recording);
  if (!reader) return tl::unexpected(reader.error());
  const std::string channel = channel_of(tool);
  if (!has_channel(*reader, channel)) {
    return fail(fmt::format("{}: has no poses of '{}' (it has those of: {}); name the tool with --tool, or record it",
                            recording, tool, tools_of(*reader)));
  }
  const auto samples = read_tracker_samples(*reader, channel);
  if (!samples) return tl::unexpected(samples.error());
  std::vector<TimedPose> poses;
  for (const TrackerSample& sample : *samples) {
    if (sample.state == ToolState::kOk) {
      poses.push_back({to_seconds(sample.source_time.time_since_epoch()), sample.X_WS});
    }
  }
  return in_order(std::move(poses));
}

}  // namespace perimap

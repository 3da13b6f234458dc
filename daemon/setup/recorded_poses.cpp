#include "daemon/setup/recorded_poses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "core/time/instant.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/recording_reader.hpp"
#include "drivers/recording/sensor_messages.hpp"

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

}  // namespace

Expected<std::vector<TimedPose>> read_recorded_poses(const std::string& recording, const std::string& tool) {
  auto reader = RecordingReader::open(recording);
  if (!reader) return tl::unexpected(reader.error());
  const std::string channel =
      tool == kScopeTool ? std::string(channels::kTrackerPose) : std::string(channels::kTrackedTools) + tool;
  const auto recorded = reader->channels();
  if (std::none_of(recorded.begin(), recorded.end(), [&](const RecordedChannel& c) { return c.name == channel; })) {
    return fail(fmt::format("{}: has no poses of '{}' (it has those of: {}); name the tool with --tool, or record it",
                            recording, tool, tools_of(*reader)));
  }
  if (const auto selected = reader->select(std::array{std::string_view(channel)}); !selected) {
    return tl::unexpected(selected.error());
  }
  std::vector<TimedPose> poses;
  for (;;) {
    const auto message = reader->next();
    if (!message) return tl::unexpected(message.error());
    if (!*message) break;
    const auto pose = reader->decode<perimap_TrackerPose>(**message);
    if (!pose) return tl::unexpected(pose.error());
    const auto sample = to_tracker_sample(**pose);
    if (!sample) return reader->wrong(**message, sample.error().message);
    if (sample->state != ToolState::kOk) continue;
    poses.push_back({to_seconds(sample->source_time.time_since_epoch()), sample->X_WS});
  }
  return in_order(std::move(poses));
}

}  // namespace perimap

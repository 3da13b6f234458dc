#include "drivers/recording/tracker_samples.hpp"

#include <array>
#include <utility>

#include "drivers/recording/sensor_messages.hpp"
#include "drivers/recording/topic.hpp"

namespace perimap {

Expected<std::vector<TrackerSample>> read_tracker_samples(RecordingReader& reader, std::string_view channel) {
  if (auto selected = reader.select(std::array{channel}); !selected) return tl::unexpected(std::move(selected.error()));
  std::vector<TrackerSample> samples;
  for (;;) {
    const auto message = reader.next();
    if (!message) return tl::unexpected(message.error());
    if (!*message) return samples;
    const auto pose = reader.decode<perimap_TrackerPose>(**message);
    if (!pose) return tl::unexpected(pose.error());
    const auto sample = to_tracker_sample(**pose);
    if (!sample) return reader.wrong(**message, sample.error().message);
    samples.push_back(*sample);
  }
}

}  // namespace perimap

#include "daemon/recordings/published_states.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "drivers/recording/channels.hpp"

namespace perimap {
namespace {

constexpr Duration kLongestPause = std::chrono::milliseconds(400);
constexpr std::size_t kMostCaptures = 300;

bool has_channel(const RecordingReader& reader, std::string_view name) {
  const auto channels = reader.channels();
  return std::any_of(channels.begin(), channels.end(), [name](const auto& channel) { return channel.name == name; });
}

void add(PublishedStates& states, const perimap_Surface& surface, Instant arrival) {
  auto& spans = states.spans;
  const bool goes_on = !spans.empty() && arrival >= spans.back().end && arrival - spans.back().end <= kLongestPause;
  if (goes_on) spans.back().end = arrival;
  if (!goes_on || spans.back().state != surface.state) spans.push_back({arrival, arrival, surface.state});
  // Where no frame came the capture is one that was expected.
  if (states.captures.size() < kMostCaptures && surface.reason != perimap_SURFACE_REASON_FRAME_MISSING) {
    states.captures.emplace(surface.frame_sequence, from_ns(surface.capture_time_ns));
  }
}

}  // namespace

Expected<PublishedStates> read_published_states(const std::string& file) {
  auto reader = RecordingReader::open(file, ReadMode::kWhole);
  if (!reader) return tl::unexpected(reader.error());
  PublishedStates states;
  if (has_channel(*reader, channels::kSurface)) {
    constexpr std::array<std::string_view, 1> kWanted = {channels::kSurface};
    if (auto selected = reader->select(kWanted); !selected) return tl::unexpected(selected.error());
    for (;;) {
      const auto message = reader->next();
      if (!message) return tl::unexpected(message.error());
      if (!*message) break;
      const auto surface = reader->decode<perimap_Surface>(**message);
      if (!surface) continue;  // damaged, or of a newer perimapd
      const std::string stream = (*surface)->stream;
      if (states.stream.empty() || (stream == "frame" && states.stream != stream)) {
        states.stream = stream;
        states.spans.clear();
        states.captures.clear();
      }
      if (stream == states.stream) add(states, **surface, (*message)->arrival);
    }
  }
  states.damage = reader->damage();
  if (has_channel(*reader, channels::kStatus)) {
    constexpr std::array<std::string_view, 1> kWanted = {channels::kStatus};
    if (auto selected = reader->select(kWanted); !selected) return tl::unexpected(selected.error());
    const auto status = reader->next();
    states.statuses = status && *status;
  }
  return states;
}

Expected<std::optional<Duration>> offset_to(const PublishedStates& states, const std::string& recording) {
  auto reader = RecordingReader::open(recording, ReadMode::kWhole);
  if (!reader) return tl::unexpected(reader.error());
  constexpr std::array<std::string_view, 1> kWanted = {channels::kCameraImage};
  if (auto selected = reader->select(kWanted); !selected) return tl::unexpected(selected.error());
  for (;;) {
    const auto message = reader->next();
    if (!message) return tl::unexpected(message.error());
    if (!*message) return std::optional<Duration>();
    const auto capture = states.captures.find((*message)->sequence);
    if (capture != states.captures.end()) return std::optional<Duration>(capture->second - (*message)->source_time);
  }
}

}  // namespace perimap

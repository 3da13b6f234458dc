#include "drivers/recording/recording_reader.hpp"

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

namespace perimap {

Expected<RecordingReader> RecordingReader::open(const std::string& path, ReadMode mode) {
  auto file = open_file(path);
  if (!file) return tl::unexpected(file.error());
  return open(std::move(*file), path, mode);
}

Expected<RecordingReader> RecordingReader::open(std::unique_ptr<ByteSource> source, std::string name, ReadMode mode) {
  auto mcap = McapReader::open(std::move(source), mode);
  if (!mcap) return fail(fmt::format("{}: {}", name, mcap.error().message));
  return RecordingReader(std::move(*mcap), std::move(name), mode);
}

std::vector<RecordedChannel> RecordingReader::channels() const {
  std::vector<RecordedChannel> channels;
  for (const auto& [id, channel] : mcap_.channels()) {
    const auto schema = mcap_.schemas().find(channel.schema_id);
    const bool known = schema != mcap_.schemas().end();
    channels.push_back({channel.topic, known ? schema->second.name : "", known ? schema->second.data : ""});
  }
  return channels;
}

Expected<std::optional<RecordedMessage>> RecordingReader::next() {
  while (true) {
    const auto message = mcap_.next();
    if (!message) return in_file(message.error());
    if (!*message) return std::optional<RecordedMessage>();
    constexpr auto kLatest = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
    const McapChannel& channel = mcap_.channels().at((*message)->channel_id);
    if ((*message)->log_time_ns > kLatest || (*message)->publish_time_ns > kLatest) {
      const Error error{
          fmt::format("{}: byte {}: channel {}: a time beyond the year 2262", name_, mcap_.position(), channel.topic)};
      if (mode_ == ReadMode::kStrict) return tl::unexpected(error);
      damage_.push_back(error);
      continue;
    }
    const auto schema = mcap_.schemas().find(channel.schema_id);
    RecordedMessage recorded;
    recorded.channel = channel.topic;
    if (schema != mcap_.schemas().end()) recorded.type = schema->second.name;
    recorded.arrival = from_ns(static_cast<std::int64_t>((*message)->log_time_ns));
    recorded.source_time = from_ns(static_cast<std::int64_t>((*message)->publish_time_ns));
    recorded.sequence = (*message)->sequence;
    recorded.bytes = (*message)->data;
    recorded.file_offset = mcap_.position();
    return std::optional(recorded);
  }
}

Expected<void> RecordingReader::select(std::span<const std::string_view> channel_names) {
  std::set<std::uint16_t> ids;
  for (const std::string_view name : channel_names) {
    const std::size_t before = ids.size();
    for (const auto& [id, channel] : mcap_.channels()) {
      if (channel.topic == name) ids.insert(id);
    }
    if (ids.size() == before) return fail(fmt::format("{}: there is no channel \"{}\"", name_, name));
  }
  mcap_.select(std::move(ids));
  return {};
}

std::optional<std::pair<Instant, Instant>> RecordingReader::times() const {
  const auto times = mcap_.times();
  if (!times.any()) return std::nullopt;
  static constexpr auto kLatest = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  const auto instant = [](std::uint64_t ns) { return from_ns(static_cast<std::int64_t>(std::min(ns, kLatest))); };
  return std::pair(instant(times.first_ns), instant(times.last_ns));
}

Expected<std::string> RecordingReader::attachment(std::string_view name) {
  const auto attachment = mcap_.read_attachment(name);
  if (!attachment) return in_file(attachment.error());
  return std::string(reinterpret_cast<const char*>(attachment->data.data()), attachment->data.size());
}

std::vector<Error> RecordingReader::damage() const {
  std::vector<Error> damage;
  for (const Error& error : mcap_.damage()) damage.push_back(in_file(error).value());
  damage.insert(damage.end(), damage_.begin(), damage_.end());
  return damage;
}

tl::unexpected<Error> RecordingReader::in_file(const Error& error) const {
  return fail(fmt::format("{}: {}", name_, error.message));
}

}  // namespace perimap

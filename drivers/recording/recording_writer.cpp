#include "drivers/recording/recording_writer.hpp"

#include <fmt/format.h>

namespace perimap {

Expected<RecordingWriter> RecordingWriter::create(const std::string& path, const McapWriterOptions& options) {
  auto file = create_file(path);
  if (!file) return tl::unexpected(file.error());
  return create(std::move(*file), options);
}

Expected<RecordingWriter> RecordingWriter::create(std::unique_ptr<ByteSink> sink, const McapWriterOptions& options) {
  auto mcap = McapWriter::create(std::move(sink), options);
  if (!mcap) return tl::unexpected(mcap.error());
  return RecordingWriter(std::move(*mcap));
}

Expected<ChannelId> RecordingWriter::add_channel(std::string_view name, const TopicType& type) {
  auto schema = schema_ids_.find(type.schema_name());
  if (schema == schema_ids_.end()) {
    const auto id = mcap_.add_schema(type.schema_name(), kSchemaEncoding, type.schema_text);
    if (!id) return tl::unexpected(id.error());
    schema = schema_ids_.emplace(type.schema_name(), *id).first;
  }
  const auto id = mcap_.add_channel(schema->second, name, kMessageEncoding);
  if (!id) return tl::unexpected(id.error());
  channel_types_.push_back(type.descriptor);
  return ChannelId{*id};
}

Expected<void> RecordingWriter::check_type(ChannelId channel, const TopicType& type) const {
  if (channel.value == 0 || channel.value > channel_types_.size()) {
    return fail(fmt::format("no channel of this recording has id {}", channel.value));
  }
  const dds_topic_descriptor_t* expected = channel_types_[channel.value - 1U];
  if (expected != type.descriptor) {
    return fail(fmt::format("channel {} takes {}, not {}", channel.value, expected->m_typename, type.schema_name()));
  }
  return {};
}

Expected<void> RecordingWriter::write_bytes(ChannelId channel, std::span<const std::byte> bytes, Instant arrival,
                                            Instant source_time, std::uint32_t sequence) {
  if (to_ns(arrival) < 0 || to_ns(source_time) < 0) {
    return fail(fmt::format("channel {}: a time before the clock's epoch (arrival {} ns, source {} ns)", channel.value,
                            to_ns(arrival), to_ns(source_time)));
  }
  return mcap_.write_message({channel.value, sequence, static_cast<std::uint64_t>(to_ns(arrival)),
                              static_cast<std::uint64_t>(to_ns(source_time)), bytes});
}

Expected<void> RecordingWriter::write_attachment(std::string_view name, std::string_view media_type,
                                                 std::span<const std::byte> data) {
  return mcap_.write_attachment(name, media_type, data, 0, 0);
}

}  // namespace perimap

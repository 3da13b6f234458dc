// Writes a recording: an MCAP file whose messages are IDL types.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/recording/cdr.hpp"
#include "drivers/recording/mcap_writer.hpp"

namespace perimap {

// A channel of the RecordingWriter that gave it.
struct ChannelId {
  std::uint16_t value = 0;
};

// Not for the real-time path: it allocates, compresses and writes to disk. Errors name the file.
class RecordingWriter {
 public:
  [[nodiscard]] static Expected<RecordingWriter> create(const std::string& path, const McapWriterOptions& options = {});
  [[nodiscard]] static Expected<RecordingWriter> create(std::unique_ptr<ByteSink> sink,
                                                        const McapWriterOptions& options = {});

  template <class T>
  [[nodiscard]] Expected<ChannelId> add_channel(std::string_view name) {
    return add_channel(name, topic_type<T>());
  }

  // `arrival` becomes the log time, `source_time` the publish time. T must be the type the channel was added with.
  // Times before the clock's epoch are an error.
  template <class T>
  [[nodiscard]] Expected<void> write(ChannelId channel, const T& sample, Instant arrival, Instant source_time,
                                     std::uint32_t sequence) {
    if (auto right = check_type(channel, topic_type<T>()); !right) return right;
    const auto bytes = serializer_.serialize(sample);
    if (!bytes) return tl::unexpected(bytes.error());
    return write_bytes(channel, *bytes, arrival, source_time, sequence);
  }

  // The creation time of an attachment is left at 0 ("not available"), so that equal recordings have equal bytes.
  [[nodiscard]] Expected<void> write_attachment(std::string_view name, std::string_view media_type,
                                                std::span<const std::byte> data);

  // Writes out what is buffered: what was written so far survives a crash.
  [[nodiscard]] Expected<void> flush() { return mcap_.flush(); }
  // Ends the file. Without it the destructor does, and drops errors.
  [[nodiscard]] Expected<void> finish() { return mcap_.finish(); }

 private:
  explicit RecordingWriter(McapWriter mcap) : mcap_(std::move(mcap)) {}

  [[nodiscard]] Expected<ChannelId> add_channel(std::string_view name, const TopicType& type);
  [[nodiscard]] Expected<void> check_type(ChannelId channel, const TopicType& type) const;
  [[nodiscard]] Expected<void> write_bytes(ChannelId channel, std::span<const std::byte> bytes, Instant arrival,
                                           Instant source_time, std::uint32_t sequence);

  McapWriter mcap_;
  CdrSerializer serializer_;
  std::map<std::string, std::uint16_t, std::less<>> schema_ids_;  // by schema name
  std::vector<const dds_topic_descriptor_t*> channel_types_;      // channel id - 1
};

}  // namespace perimap

// Reads a recording: an MCAP file whose messages are IDL types.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/recording/byte_source.hpp"
#include "drivers/recording/cdr.hpp"
#include "drivers/recording/mcap_reader.hpp"

namespace perimap {

struct RecordedChannel {
  std::string name;
  std::string type;         // as "perimap::TrackerPose"
  std::string schema_text;  // the IDL it was recorded with
};

// Views are valid until the reader's next call.
struct RecordedMessage {
  std::string_view channel;
  std::string_view type;
  Instant arrival;      // MCAP's log time
  Instant source_time;  // MCAP's publish time
  std::uint32_t sequence = 0;
  std::span<const std::byte> bytes;
  std::uint64_t file_offset = 0;  // of the chunk it is in
};

// Errors have the form "FILE: byte N: what is wrong".
class RecordingReader {
 public:
  [[nodiscard]] static Expected<RecordingReader> open(const std::string& path, ReadMode mode = ReadMode::kStrict);
  // `name` stands for the path in errors.
  [[nodiscard]] static Expected<RecordingReader> open(std::unique_ptr<ByteSource> source, std::string name,
                                                      ReadMode mode);

  [[nodiscard]] std::vector<RecordedChannel> channels() const;

  // The next message in the order of the file, which is the order of writing; nullopt at the end.
  [[nodiscard]] Expected<std::optional<RecordedMessage>> next();

  // Starts over and gives only messages of these channels. Fails when there is no channel of such a name.
  [[nodiscard]] Expected<void> select(std::span<const std::string_view> channel_names);

  // Goes on near there: with the first chunk that has a message that arrived then or later.
  void seek(Instant arrival) { mcap_.seek(static_cast<std::uint64_t>(std::max<std::int64_t>(to_ns(arrival), 0))); }
  // When the first and the last message arrived; nullopt where there are none.
  [[nodiscard]] std::optional<std::pair<Instant, Instant>> times() const;

  // Fails when the message is of another type or its bytes are not valid.
  template <class T>
  [[nodiscard]] Expected<Sample<T>> decode(const RecordedMessage& message) const {
    if (message.type != topic_type<T>().schema_name()) {
      return fail(fmt::format("{}: byte {}: channel {} is of type {}, not {}", name_, message.file_offset,
                              message.channel, message.type, topic_type<T>().schema_name()));
    }
    auto sample = deserialize<T>(message.bytes);
    if (!sample) return wrong(message, sample.error().message);
    return sample;
  }

  // An error about what the message says.
  [[nodiscard]] tl::unexpected<Error> wrong(const RecordedMessage& message, const std::string& what) const {
    return fail(fmt::format("{}: byte {}: channel {}: {}", name_, message.file_offset, message.channel, what));
  }

  [[nodiscard]] std::vector<std::string> attachment_names() const { return mcap_.attachment_names(); }
  // The bytes of the first attachment of that name.
  [[nodiscard]] Expected<std::string> attachment(std::string_view name);

  // With ReadMode::kWhole: what was found damaged so far. Complete once next() has given nullopt.
  [[nodiscard]] std::vector<Error> damage() const;

 private:
  RecordingReader(McapReader mcap, std::string name, ReadMode mode)
      : mcap_(std::move(mcap)), name_(std::move(name)), mode_(mode) {}

  [[nodiscard]] tl::unexpected<Error> in_file(const Error& error) const;

  McapReader mcap_;
  std::string name_;
  ReadMode mode_;
  std::vector<Error> damage_;  // found here, above the container
};

}  // namespace perimap

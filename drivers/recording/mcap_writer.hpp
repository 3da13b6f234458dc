// Writes an MCAP file: chunks with CRC, message indexes, attachments, metadata, summary with indexes and statistics.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/recording/byte_sink.hpp"
#include "drivers/recording/mcap_format.hpp"

namespace perimap {

struct McapWriterOptions {
  std::string profile;
  std::string library = "perimap";
  // A chunk is closed by whichever bound is reached first. What is not yet in a closed chunk is lost in a crash.
  std::size_t chunk_bytes = std::size_t{4} << 20;
  Duration chunk_duration = std::chrono::seconds(1);  // of log time
  std::optional<int> zstd_level = 1;                  // nullopt: chunks are stored as they are
};

// Equal calls give equal bytes: no clock, no addresses. Schemas and channels are written ahead of the chunks that need
// them and outside of them, so that a damaged chunk costs its own messages only.
//
// After an error from the sink every later call returns that error. The destructor finishes the file and drops errors;
// call finish() to see them.
class McapWriter {
 public:
  [[nodiscard]] static Expected<McapWriter> create(std::unique_ptr<ByteSink> sink, const McapWriterOptions& options);
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;
  McapWriter(McapWriter&&) noexcept;
  McapWriter& operator=(McapWriter&&) noexcept;
  ~McapWriter();

  // Both return the new id.
  [[nodiscard]] Expected<std::uint16_t> add_schema(std::string_view name, std::string_view encoding,
                                                   std::string_view data);
  [[nodiscard]] Expected<std::uint16_t> add_channel(std::uint16_t schema_id, std::string_view topic,
                                                    std::string_view message_encoding,
                                                    const std::map<std::string, std::string>& metadata = {});
  // The channel must have been added here.
  [[nodiscard]] Expected<void> write_message(const McapMessage& message);
  [[nodiscard]] Expected<void> write_attachment(std::string_view name, std::string_view media_type,
                                                std::span<const std::byte> data, std::uint64_t log_time_ns,
                                                std::uint64_t create_time_ns);
  [[nodiscard]] Expected<void> write_metadata(std::string_view name, const std::map<std::string, std::string>& values);

  // Closes the open chunk: what was written so far survives a crash.
  [[nodiscard]] Expected<void> flush();
  // Writes the summary and closes the sink. Nothing can be written after it; a second call does nothing.
  [[nodiscard]] Expected<void> finish();

 private:
  class Impl;
  explicit McapWriter(std::unique_ptr<Impl> impl) noexcept;
  std::unique_ptr<Impl> impl_;
};

}  // namespace perimap

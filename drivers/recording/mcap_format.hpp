// The MCAP container (https://mcap.dev/spec), as far as reader and writer share it.
//
//   magic, Header, data section (Schema, Channel, Chunk, MessageIndex, Attachment, Metadata ... DataEnd),
//   summary section (copies and indexes), summary offsets, Footer, magic
//
// A record is an opcode (1 byte), the length of its content (8 bytes) and the content. Numbers are little-endian;
// strings, maps and arrays have a 4-byte length in bytes in front. CRCs are CRC-32 (that of zlib); 0 means none.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace perimap {

namespace mcap {

inline constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'M', 'C', 'A', 'P', 0x30, '\r', '\n'};
inline constexpr std::size_t kRecordHeaderBytes = 1 + 8;

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

inline constexpr std::size_t kFooterContentBytes = 8 + 8 + 4;
inline constexpr std::size_t kDataEndContentBytes = 4;

inline constexpr std::string_view kZstd = "zstd";

// A chunk unpacked is never larger than this, so that a damaged size cannot ask for the machine's memory.
inline constexpr std::uint64_t kMaxChunkBytes = std::uint64_t{256} << 20;

// The first and the last log time of some messages.
struct LogTimes {
  std::uint64_t first_ns = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t last_ns = 0;

  [[nodiscard]] bool any() const noexcept { return first_ns <= last_ns; }
  void add(std::uint64_t time_ns) noexcept { add(LogTimes{time_ns, time_ns}); }
  void add(const LogTimes& other) noexcept {
    first_ns = std::min(first_ns, other.first_ns);
    last_ns = std::max(last_ns, other.last_ns);
  }
};

}  // namespace mcap

// What a Schema record says. Ids start at 1; 0 means "no schema".
struct McapSchema {
  std::uint16_t id = 0;
  std::string name;
  std::string encoding;
  std::string data;
};

struct McapChannel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;
  std::string topic;
  std::string message_encoding;
  std::map<std::string, std::string> metadata;
};

struct McapMessage {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  std::span<const std::byte> data;  // borrowed
};

struct McapAttachment {
  std::string name;
  std::string media_type;
  std::uint64_t log_time_ns = 0;
  std::uint64_t create_time_ns = 0;
  std::vector<std::byte> data;
};

}  // namespace perimap

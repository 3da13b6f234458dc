#include "drivers/recording/mcap_reader.hpp"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstring>
#include <utility>

#include "drivers/recording/crc32.hpp"

namespace perimap {
namespace {

using mcap::Opcode;

using Buffer = std::vector<std::byte>;

tl::unexpected<Error> fail_at(std::uint64_t byte, std::string_view what) {
  return fail(fmt::format("byte {}: {}", byte, what));
}

bool is_magic(std::span<const std::byte> bytes) {
  return std::equal(bytes.begin(), bytes.end(), mcap::kMagic.begin(), mcap::kMagic.end(),
                    [](std::byte a, std::uint8_t b) { return std::to_integer<std::uint8_t>(a) == b; });
}

// Bounds-checked little-endian fields. Once a field did not fit, every later one is empty and ok() is false.
class Cursor {
 public:
  explicit Cursor(std::span<const std::byte> bytes) noexcept : bytes_(bytes) {}

  template <std::unsigned_integral U>
  U take() noexcept {
    const auto bytes = take_bytes(sizeof(U));
    U value = 0;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      value = static_cast<U>(value | static_cast<U>(std::to_integer<U>(bytes[i]) << (8 * i)));
    }
    return value;
  }

  std::span<const std::byte> take_bytes(std::uint64_t count) noexcept {
    if (!ok_ || count > left()) {
      ok_ = false;
      return {};
    }
    const auto taken = bytes_.subspan(at_, static_cast<std::size_t>(count));
    at_ += taken.size();
    return taken;
  }

  std::string_view take_string() noexcept {
    const auto bytes = take_bytes(take<std::uint32_t>());
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }

  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] std::size_t at() const noexcept { return at_; }
  [[nodiscard]] std::size_t left() const noexcept { return bytes_.size() - at_; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

struct RecordHeader {
  Opcode opcode{};
  std::uint64_t length = 0;  // of the content
};

RecordHeader take_record_header(Cursor& cursor) {
  const auto opcode = static_cast<Opcode>(cursor.take<std::uint8_t>());
  return {opcode, cursor.take<std::uint64_t>()};
}

std::optional<McapSchema> parse_schema(std::span<const std::byte> content) {
  Cursor cursor(content);
  McapSchema schema;
  schema.id = cursor.take<std::uint16_t>();
  schema.name = cursor.take_string();
  schema.encoding = cursor.take_string();
  schema.data = cursor.take_string();
  if (!cursor.ok() || schema.id == 0) return std::nullopt;
  return schema;
}

std::optional<McapChannel> parse_channel(std::span<const std::byte> content) {
  Cursor cursor(content);
  McapChannel channel;
  channel.id = cursor.take<std::uint16_t>();
  channel.schema_id = cursor.take<std::uint16_t>();
  channel.topic = cursor.take_string();
  channel.message_encoding = cursor.take_string();
  Cursor metadata(cursor.take_bytes(cursor.take<std::uint32_t>()));
  while (cursor.ok() && metadata.ok() && metadata.left() > 0) {
    const std::string_view key = metadata.take_string();
    channel.metadata.emplace(key, metadata.take_string());
  }
  if (!cursor.ok() || !metadata.ok()) return std::nullopt;
  return channel;
}

constexpr std::size_t kMessageHeaderBytes = 2 + 4 + 8 + 8;

std::optional<McapMessage> parse_message(std::span<const std::byte> content) {
  Cursor cursor(content);
  McapMessage message;
  message.channel_id = cursor.take<std::uint16_t>();
  message.sequence = cursor.take<std::uint32_t>();
  message.log_time_ns = cursor.take<std::uint64_t>();
  message.publish_time_ns = cursor.take<std::uint64_t>();
  if (!cursor.ok()) return std::nullopt;
  message.data = content.subspan(kMessageHeaderBytes);
  return message;
}

// Where messages are: a chunk, or a message record outside of any.
struct Segment {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;                // of the whole record
  std::vector<std::uint16_t> channel_ids;  // empty: not known
};

struct AttachmentEntry {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::string name;
};

// Damage beyond this many places is not listed one by one.
constexpr std::size_t kMaxDamage = 1000;

// A zstd block takes 4 bytes at least and unpacks to 128 KiB at most (RFC 8878 §3.1.1.2), so no honest chunk is packed
// tighter than this.
constexpr std::uint64_t kMaxZstdRatio = (std::uint64_t{128} << 10) / 4;

}  // namespace

class McapReader::Impl {
 public:
  Impl(std::unique_ptr<ByteSource> source, ReadMode mode)
      : source_(std::move(source)), size_(source_->size()), mode_(mode), decompressor_(ZSTD_createDCtx()) {}

  Expected<void> open() {
    if (size_ == 0) return fail_at(0, "the recording is empty");
    if (size_ < mcap::kMagic.size()) return fail_at(size_, "the recording ends within its first 8 bytes");
    std::array<std::byte, mcap::kMagic.size()> magic{};
    if (auto read = source_->read_at(0, magic); !read) return read;
    if (!is_magic(magic)) return fail_at(0, "this is not an MCAP recording");
    Expected<bool> indexed = open_by_index();
    if (!indexed) {
      if (auto noted = note(indexed.error()); !noted) return noted;
      schemas_.clear();
      channels_.clear();
      segments_.clear();
      attachments_.clear();
      data_end_.reset();
    }
    if (!indexed || !*indexed) {
      if (auto scanned = scan(); !scanned) return scanned;
    }
    return {};
  }

  Expected<std::optional<McapMessage>> next() {
    while (true) {
      while (chunk_at_ < chunk_.size()) {
        // The chunk was examined whole by load_chunk(), so its records fit.
        Cursor cursor(std::span<const std::byte>(chunk_).subspan(chunk_at_));
        const RecordHeader header = take_record_header(cursor);
        const auto content = cursor.take_bytes(header.length);
        chunk_at_ += cursor.at();
        if (header.opcode != Opcode::kMessage) continue;
        const auto message = parse_message(content);
        if (message && channels_.contains(message->channel_id) && is_selected(message->channel_id)) return message;
      }
      if (next_segment_ == segments_.size()) {
        if (auto ended = check_data_section(); !ended) {
          if (auto noted = note(ended.error()); !noted) return tl::unexpected(noted.error());
        }
        return std::optional<McapMessage>();
      }
      const Segment& segment = segments_[next_segment_++];
      chunk_at_ = 0;
      chunk_.clear();
      if (!is_wanted(segment)) {
        data_crc_valid_ = false;
        continue;
      }
      position_ = segment.offset;
      if (auto loaded = load_segment(segment); !loaded) {
        chunk_.clear();
        data_crc_valid_ = false;
        if (auto noted = note(loaded.error()); !noted) return tl::unexpected(noted.error());
      }
    }
  }

  void select(std::optional<std::set<std::uint16_t>> channel_ids) {
    selected_ = std::move(channel_ids);
    next_segment_ = 0;
    chunk_.clear();
    chunk_at_ = 0;
    data_crc_ = 0;
    data_crc_end_ = 0;
    data_crc_valid_ = true;
  }

  Expected<McapAttachment> read_attachment(std::string_view name) {
    const auto entry = std::find_if(attachments_.begin(), attachments_.end(),
                                    [&](const AttachmentEntry& attachment) { return attachment.name == name; });
    if (entry == attachments_.end()) return fail(fmt::format("there is no attachment \"{}\"", name));
    return load_attachment(entry->offset, entry->length);
  }

  std::vector<std::string> attachment_names() const {
    std::vector<std::string> names;
    for (const AttachmentEntry& attachment : attachments_) names.push_back(attachment.name);
    return names;
  }

  const std::map<std::uint16_t, McapSchema>& schemas() const noexcept { return schemas_; }
  const std::map<std::uint16_t, McapChannel>& channels() const noexcept { return channels_; }
  const std::vector<Error>& damage() const noexcept { return damage_; }
  std::uint64_t position() const noexcept { return position_; }

 private:
  struct FreeDecompressor {
    void operator()(ZSTD_DCtx* context) const noexcept { ZSTD_freeDCtx(context); }
  };

  struct DataEnd {
    std::uint64_t offset = 0;
    std::uint32_t crc = 0;
  };

  // Damage: an error in strict mode, kept in the list otherwise.
  Expected<void> note(const Error& error) {
    if (mode_ == ReadMode::kStrict) return tl::unexpected(error);
    const auto same = [&](const Error& known) { return known.message == error.message; };
    if (damage_.size() < kMaxDamage && std::none_of(damage_.begin(), damage_.end(), same)) damage_.push_back(error);
    return {};
  }

  // Header of the record at `offset` <= size_. The record lies whole within the file.
  Expected<RecordHeader> read_record_header(std::uint64_t offset) {
    const std::uint64_t left = size_ - offset;
    if (left == 0) return fail_at(size_, "the recording ends before its data section does");
    if (left < mcap::kRecordHeaderBytes) {
      return fail_at(size_, fmt::format("the recording ends within the record header at byte {}", offset));
    }
    std::array<std::byte, mcap::kRecordHeaderBytes> bytes{};
    if (auto read = source_->read_at(offset, bytes); !read) return tl::unexpected(read.error());
    Cursor cursor(bytes);
    const RecordHeader header = take_record_header(cursor);
    if (header.length > left - mcap::kRecordHeaderBytes) {
      return fail_at(offset, fmt::format("a record of kind 0x{:02x} claims {} bytes, but the recording ends at byte {}",
                                         static_cast<unsigned>(header.opcode), header.length, size_));
    }
    return header;
  }

  // The record's content. `length` has been held against the size of the file.
  Expected<Buffer> read_content(std::uint64_t offset, std::uint64_t length) {
    Buffer content(static_cast<std::size_t>(length));
    if (auto read = source_->read_at(offset + mcap::kRecordHeaderBytes, content); !read) {
      return tl::unexpected(read.error());
    }
    return content;
  }

  // False when the file is whole but has no usable summary.
  Expected<bool> open_by_index() {
    constexpr std::uint64_t kFooterBytes = mcap::kRecordHeaderBytes + mcap::kFooterContentBytes;
    constexpr std::uint64_t kTailBytes = kFooterBytes + mcap::kMagic.size();
    if (size_ < mcap::kMagic.size() + kTailBytes) return fail_at(size_, "the recording ends without its footer");
    std::array<std::byte, kTailBytes> tail{};
    const std::uint64_t footer_offset = size_ - kTailBytes;
    if (auto read = source_->read_at(footer_offset, tail); !read) return tl::unexpected(read.error());
    if (!is_magic(std::span(tail).last(mcap::kMagic.size()))) {
      return fail_at(size_, "the recording ends without its closing magic: it was not finished, or cut off");
    }
    Cursor cursor(tail);
    const RecordHeader header = take_record_header(cursor);
    if (header.opcode != Opcode::kFooter || header.length != mcap::kFooterContentBytes) {
      return fail_at(footer_offset, "there is no footer record here");
    }
    const auto summary_start = cursor.take<std::uint64_t>();
    const auto offsets_start = cursor.take<std::uint64_t>();
    const auto summary_crc = cursor.take<std::uint32_t>();
    if (summary_start == 0) return false;
    constexpr std::uint64_t kDataEndBytes = mcap::kRecordHeaderBytes + mcap::kDataEndContentBytes;
    if (summary_start < mcap::kMagic.size() + kDataEndBytes || summary_start > footer_offset) {
      return fail_at(footer_offset, fmt::format("the summary cannot start at byte {}", summary_start));
    }
    const std::uint64_t summary_end = offsets_start == 0 ? footer_offset : offsets_start;
    if (summary_end < summary_start || summary_end > footer_offset) {
      return fail_at(footer_offset, fmt::format("the summary offsets cannot start at byte {}", offsets_start));
    }
    Buffer summary(static_cast<std::size_t>(footer_offset - summary_start));
    if (auto read = source_->read_at(summary_start, summary); !read) return tl::unexpected(read.error());
    if (summary_crc != 0) {
      const std::uint32_t crc = crc32_update(crc32_update(0, summary), std::span(tail).first(kFooterBytes - 4));
      if (crc != summary_crc) {
        return fail_at(summary_start, fmt::format("the summary's CRC is {:08x}, stored is {:08x}", crc, summary_crc));
      }
    }
    if (auto found = read_data_end(summary_start - kDataEndBytes); !found) return tl::unexpected(found.error());
    return parse_summary(std::span(summary).first(static_cast<std::size_t>(summary_end - summary_start)),
                         summary_start);
  }

  Expected<void> read_data_end(std::uint64_t offset) {
    std::array<std::byte, mcap::kRecordHeaderBytes + mcap::kDataEndContentBytes> record{};
    if (auto read = source_->read_at(offset, record); !read) return read;
    Cursor cursor(record);
    const RecordHeader header = take_record_header(cursor);
    if (header.opcode != Opcode::kDataEnd || header.length != mcap::kDataEndContentBytes) {
      return fail_at(offset, "the data section does not end here, where the summary says so");
    }
    data_end_ = {offset, cursor.take<std::uint32_t>()};
    return {};
  }

  // False when it does not say where all messages are.
  Expected<bool> parse_summary(std::span<const std::byte> summary, std::uint64_t start) {
    std::optional<std::uint32_t> chunk_count;
    Cursor records(summary);
    while (records.left() > 0) {
      const std::uint64_t offset = start + records.at();
      const RecordHeader header = take_record_header(records);
      const auto content = records.take_bytes(header.length);
      if (!records.ok()) return fail_at(offset, "a record of the summary is longer than the summary");
      bool parsed = true;
      if (header.opcode == Opcode::kSchema) {
        parsed = add_schema(content);
      } else if (header.opcode == Opcode::kChannel) {
        parsed = add_channel(content);
      } else if (header.opcode == Opcode::kStatistics) {
        Cursor cursor(content);
        cursor.take_bytes(8 + 2 + 4 + 4 + 4);  // counts of messages, schemas, channels, attachments, metadata
        chunk_count = cursor.take<std::uint32_t>();
        parsed = cursor.ok();
      } else if (header.opcode == Opcode::kChunkIndex) {
        parsed = add_chunk_index(content);
      } else if (header.opcode == Opcode::kAttachmentIndex) {
        parsed = add_attachment_index(content);
      }
      if (!parsed) return fail_at(offset, "a record of the summary is malformed");
    }
    std::sort(segments_.begin(), segments_.end(),
              [](const Segment& a, const Segment& b) { return a.offset < b.offset; });
    for (std::size_t i = 1; i < segments_.size(); ++i) {
      if (segments_[i].offset - segments_[i - 1].offset < segments_[i - 1].length) {
        return fail_at(start, fmt::format("the index has two chunks at byte {}", segments_[i].offset));
      }
    }
    if (segments_.empty() || (chunk_count && *chunk_count != segments_.size())) {
      segments_.clear();
      attachments_.clear();
      return false;
    }
    return true;
  }

  bool add_schema(std::span<const std::byte> content) {
    auto schema = parse_schema(content);
    if (!schema) return false;
    schemas_.emplace(schema->id, std::move(*schema));
    return true;
  }

  bool add_channel(std::span<const std::byte> content) {
    auto channel = parse_channel(content);
    if (!channel) return false;
    channels_.emplace(channel->id, std::move(*channel));
    return true;
  }

  bool lies_in_data_section(std::uint64_t offset, std::uint64_t length) const {
    return offset >= mcap::kMagic.size() && offset <= data_end_->offset && length >= mcap::kRecordHeaderBytes &&
           length <= data_end_->offset - offset;
  }

  bool add_chunk_index(std::span<const std::byte> content) {
    Cursor cursor(content);
    cursor.take_bytes(8 + 8);  // first and last message time
    Segment segment;
    segment.offset = cursor.take<std::uint64_t>();
    segment.length = cursor.take<std::uint64_t>();
    Cursor channels(cursor.take_bytes(cursor.take<std::uint32_t>()));
    while (channels.ok() && channels.left() > 0) {
      segment.channel_ids.push_back(channels.take<std::uint16_t>());
      channels.take<std::uint64_t>();  // where its message index is
    }
    if (!cursor.ok() || !channels.ok() || !lies_in_data_section(segment.offset, segment.length)) return false;
    segments_.push_back(std::move(segment));
    return true;
  }

  bool add_attachment_index(std::span<const std::byte> content) {
    Cursor cursor(content);
    AttachmentEntry entry;
    entry.offset = cursor.take<std::uint64_t>();
    entry.length = cursor.take<std::uint64_t>();
    cursor.take_bytes(8 + 8 + 8);  // log time, creation time, size of the data
    entry.name = cursor.take_string();
    if (!cursor.ok() || !lies_in_data_section(entry.offset, entry.length)) return false;
    attachments_.push_back(std::move(entry));
    return true;
  }

  // Walks the data section record by record and keeps what is whole.
  Expected<void> scan() {
    std::uint64_t offset = mcap::kMagic.size();
    while (true) {
      Expected<std::optional<std::uint64_t>> following = scan_record(offset);
      if (!following) {
        if (auto noted = note(following.error()); !noted) return noted;
        following = find_chunk(offset + 1);
        if (!following) return note(following.error());
      }
      if (!*following) return {};
      offset = **following;
    }
  }

  // Where the next record starts; nullopt after the last.
  Expected<std::optional<std::uint64_t>> scan_record(std::uint64_t offset) {
    const auto header = read_record_header(offset);
    if (!header) return tl::unexpected(header.error());
    const std::uint64_t length = mcap::kRecordHeaderBytes + header->length;
    const std::optional<std::uint64_t> following = offset + length;
    switch (header->opcode) {
      case Opcode::kSchema:
      case Opcode::kChannel: {
        const auto content = read_content(offset, header->length);
        if (!content) return tl::unexpected(content.error());
        const bool parsed = header->opcode == Opcode::kSchema ? add_schema(*content) : add_channel(*content);
        if (!parsed) {
          return damaged_record(offset, length, Error{fmt::format("byte {}: a malformed schema or channel", offset)});
        }
        return following;
      }
      case Opcode::kChunk:
      case Opcode::kMessage: {
        Segment segment{offset, length, {}};
        if (auto loaded = load_segment(segment); !loaded) return damaged_record(offset, length, loaded.error());
        segments_.push_back(std::move(segment));
        return following;
      }
      case Opcode::kAttachment: {
        auto attachment = load_attachment(offset, length);
        if (!attachment) return damaged_record(offset, length, attachment.error());
        attachments_.push_back({offset, length, std::move(attachment->name)});
        return following;
      }
      case Opcode::kDataEnd:
        if (header->length != mcap::kDataEndContentBytes) return fail_at(offset, "a malformed end of the data section");
        if (auto found = read_data_end(offset); !found) return tl::unexpected(found.error());
        return std::optional<std::uint64_t>();
      case Opcode::kHeader:
      case Opcode::kMessageIndex:
      case Opcode::kMetadata:
        return following;
      default:
        if (static_cast<std::uint8_t>(header->opcode) >= 0x80) return following;  // private to some other writer
        return fail_at(
            offset, fmt::format("a record of kind 0x{:02x} has no place here", static_cast<unsigned>(header->opcode)));
    }
  }

  // A record that fits into the file but is not right: if its length is, the next record follows it; if it is not, the
  // chunk after it is found by its looks.
  Expected<std::optional<std::uint64_t>> damaged_record(std::uint64_t offset, std::uint64_t length,
                                                        const Error& error) {
    if (auto noted = note(error); !noted) return tl::unexpected(noted.error());
    const auto following = read_record_header(offset + length);
    if (following && following->opcode >= Opcode::kHeader && following->opcode <= Opcode::kDataEnd) {
      return std::optional(offset + length);
    }
    return find_chunk(offset + 1);
  }

  // The first place from `from` on that looks like a zstd chunk within the file; nullopt when there is none. What it
  // finds is only a guess: the chunk's CRC decides.
  Expected<std::optional<std::uint64_t>> find_chunk(std::uint64_t from) {
    // The compression field as it stands in a chunk: length 4, "zstd", behind opcode, length, 3 sizes and a CRC.
    constexpr std::array<char, 8> kPattern{4, 0, 0, 0, 'z', 's', 't', 'd'};
    constexpr std::uint64_t kPatternOffset = mcap::kRecordHeaderBytes + 8 + 8 + 8 + 4;
    constexpr std::size_t kWindowBytes = std::size_t{64} << 10;
    const auto pattern = std::as_bytes(std::span(kPattern));
    for (std::uint64_t at = from; at < size_; at += kWindowBytes) {
      // Windows overlap, so that no place is missed at a border.
      Buffer window(static_cast<std::size_t>(
          std::min<std::uint64_t>(size_ - at, kWindowBytes + kPatternOffset + kPattern.size())));
      if (auto read = source_->read_at(at, window); !read) return tl::unexpected(read.error());
      auto found = window.begin();
      while ((found = std::search(found, window.end(), pattern.begin(), pattern.end())) != window.end()) {
        const auto distance = static_cast<std::uint64_t>(found - window.begin());
        ++found;
        if (distance < kPatternOffset) continue;
        const std::uint64_t candidate = at + distance - kPatternOffset;
        const auto header = read_record_header(candidate);
        if (header && header->opcode == Opcode::kChunk) return std::optional(candidate);
      }
    }
    return std::optional<std::uint64_t>();
  }

  bool is_selected(std::uint16_t channel_id) const { return !selected_ || selected_->count(channel_id) != 0; }

  bool is_wanted(const Segment& segment) const {
    if (!selected_ || segment.channel_ids.empty()) return true;
    return std::any_of(segment.channel_ids.begin(), segment.channel_ids.end(),
                       [this](std::uint16_t id) { return is_selected(id); });
  }

  // Leaves the segment's records in chunk_.
  Expected<void> load_segment(const Segment& segment) {
    record_.resize(static_cast<std::size_t>(segment.length));
    if (auto read = source_->read_at(segment.offset, record_); !read) return read;
    if (auto fed = feed_data_crc(segment.offset, record_); !fed) return fed;
    Cursor cursor(record_);
    const RecordHeader header = take_record_header(cursor);
    if (header.length != cursor.left()) {
      return fail_at(segment.offset,
                     fmt::format("the record claims {} bytes, the index says {}", header.length, cursor.left()));
    }
    if (header.opcode == Opcode::kMessage) {
      chunk_ = record_;
    } else if (header.opcode == Opcode::kChunk) {
      if (auto unpacked = unpack_chunk(std::span(record_).subspan(cursor.at()), segment.offset); !unpacked) {
        return unpacked;
      }
    } else {
      return fail_at(segment.offset,
                     fmt::format("a record of kind 0x{:02x}, expected a chunk", static_cast<unsigned>(header.opcode)));
    }
    return examine_chunk(segment.offset);
  }

  Expected<void> unpack_chunk(std::span<const std::byte> content, std::uint64_t offset) {
    Cursor cursor(content);
    cursor.take_bytes(8 + 8);  // first and last message time
    const auto uncompressed_size = cursor.take<std::uint64_t>();
    const auto uncompressed_crc = cursor.take<std::uint32_t>();
    const std::string_view compression = cursor.take_string();
    const auto records = cursor.take_bytes(cursor.take<std::uint64_t>());
    if (!cursor.ok()) return fail_at(offset, "the chunk's fields do not fit its length");
    if (uncompressed_size > mcap::kMaxChunkBytes) {
      return fail_at(offset, fmt::format("the chunk claims to unpack to {} bytes, more than the limit of {}",
                                         uncompressed_size, mcap::kMaxChunkBytes));
    }
    if (compression.empty()) {
      if (uncompressed_size != records.size()) return fail_at(offset, "the chunk's two sizes do not agree");
      chunk_.assign(records.begin(), records.end());
    } else if (compression == mcap::kZstd) {
      if (uncompressed_size > records.size() * kMaxZstdRatio) {
        return fail_at(offset, fmt::format("{} bytes of zstd cannot unpack to {}", records.size(), uncompressed_size));
      }
      chunk_.resize(static_cast<std::size_t>(uncompressed_size));
      const std::size_t size =
          ZSTD_decompressDCtx(decompressor_.get(), chunk_.data(), chunk_.size(), records.data(), records.size());
      if (ZSTD_isError(size) != 0) {
        return fail_at(offset, fmt::format("the chunk does not unpack: {}", ZSTD_getErrorName(size)));
      }
      if (size != chunk_.size()) {
        return fail_at(offset, fmt::format("the chunk unpacks to {} bytes, not {}", size, chunk_.size()));
      }
    } else {
      return fail_at(offset, fmt::format("the chunk's compression \"{}\" is not supported", compression));
    }
    if (uncompressed_crc != 0) {
      const std::uint32_t crc = crc32_update(0, chunk_);
      if (crc != uncompressed_crc) {
        return fail_at(offset, fmt::format("the chunk's CRC is {:08x}, stored is {:08x}", crc, uncompressed_crc));
      }
    }
    return {};
  }

  Expected<void> examine_chunk(std::uint64_t offset) {
    Cursor records(chunk_);
    while (records.left() > 0) {
      const std::size_t at = records.at();
      const RecordHeader header = take_record_header(records);
      const auto content = records.take_bytes(header.length);
      if (!records.ok()) {
        return fail_at(offset, fmt::format("the record at byte {} of the unpacked chunk is longer than the chunk", at));
      }
      bool parsed = true;
      if (header.opcode == Opcode::kMessage) {
        const auto message = parse_message(content);
        parsed = message.has_value();
        if (parsed && !channels_.contains(message->channel_id)) {
          // Its channel's record was damaged; the chunk's other messages are well.
          const auto unknown =
              fail_at(offset, fmt::format("messages of channel {}, which is not described", message->channel_id));
          if (auto noted = note(unknown.value()); !noted) return noted;
        }
      } else if (header.opcode == Opcode::kSchema) {
        parsed = add_schema(content);
      } else if (header.opcode == Opcode::kChannel) {
        parsed = add_channel(content);
      }
      if (!parsed) {
        return fail_at(offset, fmt::format("the record at byte {} of the unpacked chunk is malformed", at));
      }
    }
    return {};
  }

  Expected<McapAttachment> load_attachment(std::uint64_t offset, std::uint64_t length) {
    const auto header = read_record_header(offset);
    if (!header) return tl::unexpected(header.error());
    if (header->opcode != Opcode::kAttachment || header->length != length - mcap::kRecordHeaderBytes) {
      return fail_at(offset, fmt::format("there is no attachment of {} bytes here, where the index says so", length));
    }
    const auto content = read_content(offset, header->length);
    if (!content) return tl::unexpected(content.error());
    Cursor cursor(*content);
    McapAttachment attachment;
    attachment.log_time_ns = cursor.take<std::uint64_t>();
    attachment.create_time_ns = cursor.take<std::uint64_t>();
    attachment.name = cursor.take_string();
    attachment.media_type = cursor.take_string();
    const auto data = cursor.take_bytes(cursor.take<std::uint64_t>());
    const std::size_t covered = cursor.at();
    const auto stored_crc = cursor.take<std::uint32_t>();
    if (!cursor.ok()) return fail_at(offset, "the attachment's fields do not fit its length");
    if (stored_crc != 0) {
      const std::uint32_t crc = crc32_update(0, std::span(*content).first(covered));
      if (crc != stored_crc) {
        return fail_at(offset, fmt::format("the attachment's CRC is {:08x}, stored is {:08x}", crc, stored_crc));
      }
    }
    attachment.data.assign(data.begin(), data.end());
    return attachment;
  }

  // Takes in the bytes between the last segment and this one, then `record`.
  Expected<void> feed_data_crc(std::uint64_t offset, std::span<const std::byte> record) {
    if (!data_crc_valid_ || !data_end_ || data_end_->crc == 0) return {};
    constexpr std::uint64_t kBlockBytes = std::uint64_t{256} << 10;
    while (data_crc_end_ < offset) {
      gap_.resize(static_cast<std::size_t>(std::min(offset - data_crc_end_, kBlockBytes)));
      if (auto read = source_->read_at(data_crc_end_, gap_); !read) return read;
      data_crc_ = crc32_update(data_crc_, gap_);
      data_crc_end_ += gap_.size();
    }
    data_crc_ = crc32_update(data_crc_, record);
    data_crc_end_ += record.size();
    return {};
  }

  Expected<void> check_data_section() {
    if (!data_crc_valid_ || !data_end_ || data_end_->crc == 0) return {};
    if (auto fed = feed_data_crc(data_end_->offset, {}); !fed) return fed;
    if (data_crc_ != data_end_->crc) {
      return fail_at(data_end_->offset, fmt::format("the data section ends here with CRC {:08x}, stored is {:08x}: a "
                                                    "byte between its chunks is wrong",
                                                    data_crc_, data_end_->crc));
    }
    return {};
  }

  std::unique_ptr<ByteSource> source_;
  std::uint64_t size_;
  ReadMode mode_;
  std::unique_ptr<ZSTD_DCtx, FreeDecompressor> decompressor_;

  std::map<std::uint16_t, McapSchema> schemas_;
  std::map<std::uint16_t, McapChannel> channels_;
  std::vector<Segment> segments_;  // in order of the file
  std::vector<AttachmentEntry> attachments_;
  std::optional<DataEnd> data_end_;
  std::vector<Error> damage_;

  std::optional<std::set<std::uint16_t>> selected_;
  std::size_t next_segment_ = 0;
  std::uint64_t position_ = 0;
  Buffer record_;             // the segment as it stands in the file
  Buffer chunk_;              // its records, unpacked
  std::size_t chunk_at_ = 0;  // next record in chunk_

  Buffer gap_;
  std::uint32_t data_crc_ = 0;  // of the file's first data_crc_end_ bytes
  std::uint64_t data_crc_end_ = 0;
  bool data_crc_valid_ = true;  // false once a chunk was skipped or is damaged
};

McapReader::McapReader(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
McapReader::McapReader(McapReader&&) noexcept = default;
McapReader& McapReader::operator=(McapReader&&) noexcept = default;
McapReader::~McapReader() = default;

Expected<McapReader> McapReader::open(std::unique_ptr<ByteSource> source, ReadMode mode) {
  auto impl = std::make_unique<Impl>(std::move(source), mode);
  if (auto opened = impl->open(); !opened) return tl::unexpected(opened.error());
  impl->select(std::nullopt);
  return McapReader(std::move(impl));
}

const std::map<std::uint16_t, McapSchema>& McapReader::schemas() const noexcept { return impl_->schemas(); }
const std::map<std::uint16_t, McapChannel>& McapReader::channels() const noexcept { return impl_->channels(); }
Expected<std::optional<McapMessage>> McapReader::next() { return impl_->next(); }
std::uint64_t McapReader::position() const noexcept { return impl_->position(); }
void McapReader::select(std::optional<std::set<std::uint16_t>> channel_ids) { impl_->select(std::move(channel_ids)); }
std::vector<std::string> McapReader::attachment_names() const { return impl_->attachment_names(); }
Expected<McapAttachment> McapReader::read_attachment(std::string_view name) { return impl_->read_attachment(name); }
const std::vector<Error>& McapReader::damage() const noexcept { return impl_->damage(); }

}  // namespace perimap

#include "drivers/recording/mcap_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "drivers/recording/crc32.hpp"
#include "drivers/recording/mcap_attachment.hpp"
#include "drivers/recording/mcap_chunk.hpp"
#include "drivers/recording/mcap_data_crc.hpp"
#include "drivers/recording/mcap_fields.hpp"
#include "drivers/recording/mcap_file.hpp"
#include "drivers/recording/mcap_segment.hpp"

namespace perimap {
namespace {

using mcap::AttachmentEntry;
using mcap::Buffer;
using mcap::Cursor;
using mcap::fail_at;
using mcap::is_magic;
using mcap::Opcode;
using mcap::RecordHeader;
using mcap::Segment;

// Damage beyond this many places is not listed one by one.
constexpr std::size_t kMaxDamage = 1000;

}  // namespace

class McapReader::Impl {
 public:
  Impl(std::unique_ptr<ByteSource> source, ReadMode mode) : file_(std::move(source)), mode_(mode) {}

  Expected<void> open() {
    if (file_.size() == 0) return fail_at(0, "the recording is empty");
    if (file_.size() < mcap::kMagic.size()) return fail_at(file_.size(), "the recording ends within its first 8 bytes");
    std::array<std::byte, mcap::kMagic.size()> magic{};
    if (auto read = file_.read_at(0, magic); !read) return read;
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
        const RecordHeader header = mcap::take_record_header(cursor);
        const auto content = cursor.take_bytes(header.length);
        chunk_at_ += cursor.at();
        if (header.opcode != Opcode::kMessage) continue;
        const auto message = mcap::parse_message(content);
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
        data_crc_.give_up();
        continue;
      }
      position_ = segment.offset;
      if (auto loaded = load_segment(segment); !loaded) {
        chunk_.clear();
        data_crc_.give_up();
        if (auto noted = note(loaded.error()); !noted) return tl::unexpected(noted.error());
      }
    }
  }

  void select(std::optional<std::set<std::uint16_t>> channel_ids) {
    selected_ = std::move(channel_ids);
    next_segment_ = 0;
    chunk_.clear();
    chunk_at_ = 0;
    data_crc_.restart();
  }

  void seek(std::uint64_t log_time_ns) {
    const auto from = std::find_if(segments_.begin(), segments_.end(),
                                   [&](const Segment& segment) { return segment.times.last_ns >= log_time_ns; });
    next_segment_ = static_cast<std::size_t>(from - segments_.begin());
    chunk_.clear();
    chunk_at_ = 0;
    data_crc_.give_up();
  }

  mcap::LogTimes times() const noexcept {
    mcap::LogTimes times;
    for (const Segment& segment : segments_) times.add(segment.times);
    return times;
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

  // False when the file is whole but has no usable summary.
  Expected<bool> open_by_index() {
    constexpr std::uint64_t kFooterBytes = mcap::kRecordHeaderBytes + mcap::kFooterContentBytes;
    constexpr std::uint64_t kTailBytes = kFooterBytes + mcap::kMagic.size();
    if (file_.size() < mcap::kMagic.size() + kTailBytes)
      return fail_at(file_.size(), "the recording ends without its footer");
    std::array<std::byte, kTailBytes> tail{};
    const std::uint64_t footer_offset = file_.size() - kTailBytes;
    if (auto read = file_.read_at(footer_offset, tail); !read) return tl::unexpected(read.error());
    if (!is_magic(std::span(tail).last(mcap::kMagic.size()))) {
      return fail_at(file_.size(), "the recording ends without its closing magic: it was not finished, or cut off");
    }
    Cursor cursor(tail);
    const RecordHeader header = mcap::take_record_header(cursor);
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
    if (auto read = file_.read_at(summary_start, summary); !read) return tl::unexpected(read.error());
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
    if (auto read = file_.read_at(offset, record); !read) return read;
    Cursor cursor(record);
    const RecordHeader header = mcap::take_record_header(cursor);
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
      const RecordHeader header = mcap::take_record_header(records);
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
    auto schema = mcap::parse_schema(content);
    if (!schema) return false;
    schemas_.emplace(schema->id, std::move(*schema));
    return true;
  }

  bool add_channel(std::span<const std::byte> content) {
    auto channel = mcap::parse_channel(content);
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
    Segment segment;
    segment.times.first_ns = cursor.take<std::uint64_t>();
    segment.times.last_ns = cursor.take<std::uint64_t>();
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
        following = file_.find_chunk(offset + 1);
        if (!following) return note(following.error());
      }
      if (!*following) return {};
      offset = **following;
    }
  }

  // Where the next record starts; nullopt after the last.
  Expected<std::optional<std::uint64_t>> scan_record(std::uint64_t offset) {
    const auto header = file_.record_header(offset);
    if (!header) return tl::unexpected(header.error());
    const std::uint64_t length = mcap::kRecordHeaderBytes + header->length;
    const std::optional<std::uint64_t> following = offset + length;
    switch (header->opcode) {
      case Opcode::kSchema:
      case Opcode::kChannel: {
        const auto content = file_.content(offset, header->length);
        if (!content) return tl::unexpected(content.error());
        const bool parsed = header->opcode == Opcode::kSchema ? add_schema(*content) : add_channel(*content);
        if (!parsed) {
          return damaged_record(offset, length, Error{fmt::format("byte {}: a malformed schema or channel", offset)});
        }
        return following;
      }
      case Opcode::kChunk:
      case Opcode::kMessage: {
        Segment segment{offset, length, {}, {}};
        if (auto loaded = load_segment(segment); !loaded) return damaged_record(offset, length, loaded.error());
        segment.times = loaded_times_;
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
    const auto following = file_.record_header(offset + length);
    if (following && following->opcode >= Opcode::kHeader && following->opcode <= Opcode::kDataEnd) {
      return std::optional(offset + length);
    }
    return file_.find_chunk(offset + 1);
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
    if (auto read = file_.read_at(segment.offset, record_); !read) return read;
    if (has_data_crc()) {
      if (auto fed = data_crc_.feed(file_.source(), segment.offset, record_); !fed) return fed;
    }
    Cursor cursor(record_);
    const RecordHeader header = mcap::take_record_header(cursor);
    if (header.length != cursor.left()) {
      return fail_at(segment.offset,
                     fmt::format("the record claims {} bytes, the index says {}", header.length, cursor.left()));
    }
    if (header.opcode == Opcode::kMessage) {
      chunk_ = record_;
    } else if (header.opcode == Opcode::kChunk) {
      const auto content = std::span<const std::byte>(record_).subspan(cursor.at());
      if (auto unpacked = unpacker_.unpack(content, segment.offset, chunk_); !unpacked) return unpacked;
    } else {
      return fail_at(segment.offset,
                     fmt::format("a record of kind 0x{:02x}, expected a chunk", static_cast<unsigned>(header.opcode)));
    }
    return examine_chunk(segment.offset);
  }

  Expected<void> examine_chunk(std::uint64_t offset) {
    loaded_times_ = {};
    Cursor records(chunk_);
    while (records.left() > 0) {
      const std::size_t at = records.at();
      const RecordHeader header = mcap::take_record_header(records);
      const auto content = records.take_bytes(header.length);
      if (!records.ok()) {
        return fail_at(offset, fmt::format("the record at byte {} of the unpacked chunk is longer than the chunk", at));
      }
      bool parsed = true;
      if (header.opcode == Opcode::kMessage) {
        const auto message = mcap::parse_message(content);
        parsed = message.has_value();
        if (parsed) loaded_times_.add(message->log_time_ns);
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
    const auto header = file_.record_header(offset);
    if (!header) return tl::unexpected(header.error());
    if (header->opcode != Opcode::kAttachment || header->length != length - mcap::kRecordHeaderBytes) {
      return fail_at(offset, fmt::format("there is no attachment of {} bytes here, where the index says so", length));
    }
    const auto content = file_.content(offset, header->length);
    if (!content) return tl::unexpected(content.error());
    return mcap::parse_attachment(*content, offset);
  }

  [[nodiscard]] bool has_data_crc() const noexcept { return data_crc_.valid() && data_end_ && data_end_->crc != 0; }

  Expected<void> check_data_section() {
    if (!has_data_crc()) return {};
    if (auto fed = data_crc_.feed(file_.source(), data_end_->offset, {}); !fed) return fed;
    if (data_crc_.value() != data_end_->crc) {
      return fail_at(data_end_->offset, fmt::format("the data section ends here with CRC {:08x}, stored is {:08x}: a "
                                                    "byte between its chunks is wrong",
                                                    data_crc_.value(), data_end_->crc));
    }
    return {};
  }

  mcap::McapFile file_;
  ReadMode mode_;
  mcap::ChunkUnpacker unpacker_;

  std::map<std::uint16_t, McapSchema> schemas_;
  std::map<std::uint16_t, McapChannel> channels_;
  std::vector<Segment> segments_;  // in order of the file
  std::vector<AttachmentEntry> attachments_;
  std::optional<DataEnd> data_end_;
  std::vector<Error> damage_;

  std::optional<std::set<std::uint16_t>> selected_;
  std::size_t next_segment_ = 0;
  std::uint64_t position_ = 0;
  Buffer record_;                // the segment as it stands in the file
  Buffer chunk_;                 // its records, unpacked
  std::size_t chunk_at_ = 0;     // next record in chunk_
  mcap::LogTimes loaded_times_;  // of the segment loaded last

  mcap::DataSectionCrc data_crc_;
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
void McapReader::seek(std::uint64_t log_time_ns) { impl_->seek(log_time_ns); }
mcap::LogTimes McapReader::times() const noexcept { return impl_->times(); }
std::vector<std::string> McapReader::attachment_names() const { return impl_->attachment_names(); }
Expected<McapAttachment> McapReader::read_attachment(std::string_view name) { return impl_->read_attachment(name); }
const std::vector<Error>& McapReader::damage() const noexcept { return impl_->damage(); }

}  // namespace perimap

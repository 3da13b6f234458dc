#include "drivers/recording/mcap_writer.hpp"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "drivers/recording/crc32.hpp"
#include "drivers/recording/mcap_put.hpp"

namespace perimap {
namespace {

using mcap::Buffer;
using mcap::Opcode;
using mcap::put;
using mcap::put_at;
using mcap::put_block;
using mcap::put_record;

struct MessageTimes {
  std::uint64_t first_ns = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t last_ns = 0;

  void add(std::uint64_t time_ns) {
    first_ns = std::min(first_ns, time_ns);
    last_ns = std::max(last_ns, time_ns);
  }
};

struct ChunkEntry {
  MessageTimes times;
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::map<std::uint16_t, std::uint64_t> message_index_offsets;
  std::uint64_t message_index_length = 0;
  std::uint64_t compressed_size = 0;
  std::uint64_t uncompressed_size = 0;
};

struct WrittenAttachment {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t create_time_ns = 0;
  std::uint64_t data_size = 0;
  std::string name;
  std::string media_type;
};

struct MetadataEntry {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::string name;
};

struct IndexEntry {
  std::uint64_t log_time_ns = 0;
  std::uint64_t offset = 0;  // of the message record in the unpacked chunk
};

constexpr std::size_t kMaxStringBytes = std::size_t{64} << 20;

}  // namespace

class McapWriter::Impl {
 public:
  Impl(std::unique_ptr<ByteSink> sink, const McapWriterOptions& options)
      : sink_(std::move(sink)), options_(options), compressor_(ZSTD_createCCtx()) {}

  Expected<void> begin() {
    if (options_.zstd_level) {
      const std::size_t set = ZSTD_CCtx_setParameter(compressor_.get(), ZSTD_c_compressionLevel, *options_.zstd_level);
      if (ZSTD_isError(set) != 0) return fail(fmt::format("zstd level {} is not possible", *options_.zstd_level));
    }
    out_.clear();
    put(out_, std::as_bytes(std::span(mcap::kMagic)));
    put_record(out_, Opcode::kHeader, [&] {
      put(out_, std::string_view(options_.profile));
      put(out_, std::string_view(options_.library));
    });
    return emit();
  }

  Expected<std::uint16_t> add_schema(std::string_view name, std::string_view encoding, std::string_view data) {
    if (auto open = writable(); !open) return tl::unexpected(open.error());
    if (schemas_.size() >= std::numeric_limits<std::uint16_t>::max()) return fail("too many schemas");
    if (std::max({name.size(), encoding.size(), data.size()}) > kMaxStringBytes) return fail("schema is too long");
    const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
    schemas_.push_back({id, std::string(name), std::string(encoding), std::string(data)});
    out_.clear();
    put(out_, schemas_.back());
    if (auto written = emit(); !written) return tl::unexpected(written.error());
    return id;
  }

  Expected<std::uint16_t> add_channel(std::uint16_t schema_id, std::string_view topic,
                                      std::string_view message_encoding,
                                      const std::map<std::string, std::string>& metadata) {
    if (auto open = writable(); !open) return tl::unexpected(open.error());
    if (channels_.size() >= std::numeric_limits<std::uint16_t>::max()) return fail("too many channels");
    if (schema_id > schemas_.size()) return fail(fmt::format("channel {}: no schema has id {}", topic, schema_id));
    if (std::max(topic.size(), message_encoding.size()) > kMaxStringBytes) return fail("channel name is too long");
    const auto id = static_cast<std::uint16_t>(channels_.size() + 1);
    channels_.push_back({id, schema_id, std::string(topic), std::string(message_encoding), metadata});
    message_counts_.push_back(0);
    index_.emplace_back();
    out_.clear();
    put(out_, channels_.back());
    if (auto written = emit(); !written) return tl::unexpected(written.error());
    return id;
  }

  Expected<void> write_message(const McapMessage& message) {
    if (auto open = writable(); !open) return open;
    if (message.channel_id == 0 || message.channel_id > channels_.size()) {
      return fail(fmt::format("no channel has id {}", message.channel_id));
    }
    constexpr std::size_t kMessageOverhead = mcap::kRecordHeaderBytes + 2 + 4 + 8 + 8;
    if (message.data.size() > mcap::kMaxChunkBytes - kMessageOverhead) {
      return fail(fmt::format("channel {}: a message of {} bytes is too large",
                              channels_[message.channel_id - 1U].topic, message.data.size()));
    }
    const auto span_ns = static_cast<std::uint64_t>(std::max<Duration::rep>(options_.chunk_duration.count(), 0));
    if (!chunk_.empty()) {
      MessageTimes with = chunk_times_;
      with.add(message.log_time_ns);
      if (chunk_.size() + kMessageOverhead + message.data.size() > options_.chunk_bytes ||
          with.last_ns - with.first_ns > span_ns) {
        if (auto flushed = flush(); !flushed) return flushed;
      }
    }
    index_[message.channel_id - 1U].push_back({message.log_time_ns, chunk_.size()});
    chunk_times_.add(message.log_time_ns);
    put(chunk_, static_cast<std::uint8_t>(Opcode::kMessage));
    put(chunk_, static_cast<std::uint64_t>(kMessageOverhead - mcap::kRecordHeaderBytes + message.data.size()));
    put(chunk_, message.channel_id);
    put(chunk_, message.sequence);
    put(chunk_, message.log_time_ns);
    put(chunk_, message.publish_time_ns);
    put(chunk_, message.data);
    ++message_counts_[message.channel_id - 1U];
    return {};
  }

  Expected<void> write_attachment(std::string_view name, std::string_view media_type, std::span<const std::byte> data,
                                  std::uint64_t log_time_ns, std::uint64_t create_time_ns) {
    if (auto open = writable(); !open) return open;
    if (std::max(name.size(), media_type.size()) > kMaxStringBytes) return fail("attachment name is too long");
    out_.clear();
    put_record(out_, Opcode::kAttachment, [&] {
      put(out_, log_time_ns);
      put(out_, create_time_ns);
      put(out_, name);
      put(out_, media_type);
      put(out_, static_cast<std::uint64_t>(data.size()));
      put(out_, data);
      put(out_, crc32_update(0, std::span(out_).subspan(mcap::kRecordHeaderBytes)));
    });
    attachments_.push_back(
        {offset_, out_.size(), log_time_ns, create_time_ns, data.size(), std::string(name), std::string(media_type)});
    return emit();
  }

  Expected<void> write_metadata(std::string_view name, const std::map<std::string, std::string>& values) {
    if (auto open = writable(); !open) return open;
    out_.clear();
    put_record(out_, Opcode::kMetadata, [&] {
      put(out_, name);
      put(out_, values);
    });
    metadata_.push_back({offset_, out_.size(), std::string(name)});
    return emit();
  }

  Expected<void> flush() {
    if (auto open = writable(); !open) return open;
    if (chunk_.empty()) return {};
    ChunkEntry entry;
    entry.times = chunk_times_;
    entry.offset = offset_;
    entry.uncompressed_size = chunk_.size();
    out_.clear();
    put(out_, static_cast<std::uint8_t>(Opcode::kChunk));
    put(out_, std::uint64_t{0});
    put(out_, entry.times.first_ns);
    put(out_, entry.times.last_ns);
    put(out_, entry.uncompressed_size);
    put(out_, crc32_update(0, chunk_));
    put(out_, options_.zstd_level ? mcap::kZstd : std::string_view());
    const auto records = pack(chunk_);
    if (!records) return stick(records.error().message);
    entry.compressed_size = records->size();
    put(out_, entry.compressed_size);
    entry.length = out_.size() + records->size();
    put_at(out_, 1, entry.length - mcap::kRecordHeaderBytes);
    // In two writes: the records themselves are copied nowhere else.
    if (auto written = emit(); !written) return written;
    if (auto written = emit(*records); !written) return written;

    out_.clear();
    for (std::size_t i = 0; i < index_.size(); ++i) {
      if (index_[i].empty()) continue;
      const auto channel_id = static_cast<std::uint16_t>(i + 1);
      entry.message_index_offsets[channel_id] = offset_ + out_.size();
      put_record(out_, Opcode::kMessageIndex, [&] {
        put(out_, channel_id);
        put_block(out_, [&] {
          for (const IndexEntry& message : index_[i]) {
            put(out_, message.log_time_ns);
            put(out_, message.offset);
          }
        });
      });
      index_[i].clear();
    }
    entry.message_index_length = out_.size();
    all_times_.add(chunk_times_.first_ns);
    all_times_.add(chunk_times_.last_ns);
    chunk_times_ = {};
    chunk_.clear();
    chunks_.push_back(std::move(entry));
    return emit();
  }

  Expected<void> finish() {
    if (finished_) return {};
    if (auto flushed = flush(); !flushed) return flushed;
    finished_ = true;
    out_.clear();
    const std::uint32_t data_section_crc = crc_;
    put_record(out_, Opcode::kDataEnd, [&] { put(out_, data_section_crc); });
    if (auto written = emit(); !written) return written;
    out_.clear();
    put_summary();
    put(out_, std::as_bytes(std::span(mcap::kMagic)));
    if (auto written = emit(); !written) return written;
    if (auto closed = sink_->close(); !closed) return stick(closed.error().message);
    return {};
  }

 private:
  struct FreeCompressor {
    void operator()(ZSTD_CCtx* context) const noexcept { ZSTD_freeCCtx(context); }
  };

  Expected<void> writable() const {
    if (error_) return tl::unexpected(*error_);
    if (finished_) return fail("the recording is already finished");
    return {};
  }

  tl::unexpected<Error> stick(std::string message) {
    error_ = Error{std::move(message)};
    return tl::unexpected(*error_);
  }

  Expected<void> emit() { return emit(out_); }
  Expected<void> emit(std::span<const std::byte> bytes) {
    if (auto written = sink_->write(bytes); !written) return stick(written.error().message);
    crc_ = crc32_update(crc_, bytes);
    offset_ += bytes.size();
    return {};
  }

  // The records as they stand in the file, in memory that is filled with nothing else first.
  Expected<std::span<const std::byte>> pack(std::span<const std::byte> records) {
    if (!options_.zstd_level) return records;
    if (packed_.size() < ZSTD_compressBound(records.size())) packed_.resize(ZSTD_compressBound(records.size()));
    const std::size_t size =
        ZSTD_compress2(compressor_.get(), packed_.data(), packed_.size(), records.data(), records.size());
    if (ZSTD_isError(size) != 0) return fail(fmt::format("zstd cannot compress: {}", ZSTD_getErrorName(size)));
    return std::span<const std::byte>(packed_).first(size);
  }

  // Records of one kind stand together, so that a summary offset can name them (spec: "Summary Offset").
  void put_summary() {
    struct Group {
      Opcode opcode;
      std::size_t start;
      std::size_t length;
    };
    std::vector<Group> groups;
    const auto put_group = [&](Opcode opcode, const auto& fill) {
      const std::size_t start = out_.size();
      fill();
      if (out_.size() > start) groups.push_back({opcode, start, out_.size() - start});
    };
    const std::uint64_t summary_start = offset_;

    put_group(Opcode::kSchema, [&] {
      for (const McapSchema& schema : schemas_) put(out_, schema);
    });
    put_group(Opcode::kChannel, [&] {
      for (const McapChannel& channel : channels_) put(out_, channel);
    });
    put_group(Opcode::kStatistics, [&] { put_statistics(); });
    put_group(Opcode::kChunkIndex, [&] {
      for (const ChunkEntry& chunk : chunks_) put_chunk_index(chunk);
    });
    put_group(Opcode::kAttachmentIndex, [&] {
      for (const WrittenAttachment& attachment : attachments_) {
        put_record(out_, Opcode::kAttachmentIndex, [&] {
          put(out_, attachment.offset);
          put(out_, attachment.length);
          put(out_, attachment.log_time_ns);
          put(out_, attachment.create_time_ns);
          put(out_, attachment.data_size);
          put(out_, std::string_view(attachment.name));
          put(out_, std::string_view(attachment.media_type));
        });
      }
    });
    put_group(Opcode::kMetadataIndex, [&] {
      for (const MetadataEntry& metadata : metadata_) {
        put_record(out_, Opcode::kMetadataIndex, [&] {
          put(out_, metadata.offset);
          put(out_, metadata.length);
          put(out_, std::string_view(metadata.name));
        });
      }
    });

    const std::uint64_t offsets_start = offset_ + out_.size();
    for (const Group& group : groups) {
      put_record(out_, Opcode::kSummaryOffset, [&] {
        put(out_, static_cast<std::uint8_t>(group.opcode));
        put(out_, offset_ + group.start);
        put(out_, static_cast<std::uint64_t>(group.length));
      });
    }
    put(out_, static_cast<std::uint8_t>(Opcode::kFooter));
    put(out_, std::uint64_t{mcap::kFooterContentBytes});
    put(out_, summary_start);
    put(out_, offsets_start);
    put(out_, crc32_update(0, out_));
  }

  void put_statistics() {
    std::uint64_t messages = 0;
    for (const std::uint64_t count : message_counts_) messages += count;
    put_record(out_, Opcode::kStatistics, [&] {
      put(out_, messages);
      put(out_, static_cast<std::uint16_t>(schemas_.size()));
      put(out_, static_cast<std::uint32_t>(channels_.size()));
      put(out_, static_cast<std::uint32_t>(attachments_.size()));
      put(out_, static_cast<std::uint32_t>(metadata_.size()));
      put(out_, static_cast<std::uint32_t>(chunks_.size()));
      put(out_, messages == 0 ? std::uint64_t{0} : all_times_.first_ns);
      put(out_, all_times_.last_ns);
      put_block(out_, [&] {
        for (std::size_t i = 0; i < message_counts_.size(); ++i) {
          put(out_, static_cast<std::uint16_t>(i + 1));
          put(out_, message_counts_[i]);
        }
      });
    });
  }

  void put_chunk_index(const ChunkEntry& chunk) {
    put_record(out_, Opcode::kChunkIndex, [&] {
      put(out_, chunk.times.first_ns);
      put(out_, chunk.times.last_ns);
      put(out_, chunk.offset);
      put(out_, chunk.length);
      put_block(out_, [&] {
        for (const auto& [channel_id, offset] : chunk.message_index_offsets) {
          put(out_, channel_id);
          put(out_, offset);
        }
      });
      put(out_, chunk.message_index_length);
      put(out_, options_.zstd_level ? mcap::kZstd : std::string_view());
      put(out_, chunk.compressed_size);
      put(out_, chunk.uncompressed_size);
    });
  }

  std::unique_ptr<ByteSink> sink_;
  McapWriterOptions options_;
  std::unique_ptr<ZSTD_CCtx, FreeCompressor> compressor_;
  std::optional<Error> error_;
  bool finished_ = false;

  std::uint64_t offset_ = 0;  // bytes given to the sink
  std::uint32_t crc_ = 0;     // of those bytes
  Buffer out_;                // the record being built

  Buffer chunk_;   // message records of the open chunk
  Buffer packed_;  // as large as the largest chunk may become
  MessageTimes chunk_times_;
  std::vector<std::vector<IndexEntry>> index_;  // per channel, of the open chunk

  std::vector<McapSchema> schemas_;    // id = position + 1
  std::vector<McapChannel> channels_;  // id = position + 1
  std::vector<std::uint64_t> message_counts_;
  MessageTimes all_times_;
  std::vector<ChunkEntry> chunks_;
  std::vector<WrittenAttachment> attachments_;
  std::vector<MetadataEntry> metadata_;
};

McapWriter::McapWriter(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
McapWriter::McapWriter(McapWriter&&) noexcept = default;
McapWriter& McapWriter::operator=(McapWriter&& other) noexcept {
  std::swap(impl_, other.impl_);
  return *this;
}

McapWriter::~McapWriter() {
  if (!impl_) return;
  try {
    static_cast<void>(impl_->finish());
  } catch (...) {  // out of memory: the chunks that are written are readable
  }
}

Expected<McapWriter> McapWriter::create(std::unique_ptr<ByteSink> sink, const McapWriterOptions& options) {
  auto impl = std::make_unique<Impl>(std::move(sink), options);
  if (auto begun = impl->begin(); !begun) return tl::unexpected(begun.error());
  return McapWriter(std::move(impl));
}

Expected<std::uint16_t> McapWriter::add_schema(std::string_view name, std::string_view encoding,
                                               std::string_view data) {
  return impl_->add_schema(name, encoding, data);
}

Expected<std::uint16_t> McapWriter::add_channel(std::uint16_t schema_id, std::string_view topic,
                                                std::string_view message_encoding,
                                                const std::map<std::string, std::string>& metadata) {
  return impl_->add_channel(schema_id, topic, message_encoding, metadata);
}

Expected<void> McapWriter::write_message(const McapMessage& message) { return impl_->write_message(message); }

Expected<void> McapWriter::write_attachment(std::string_view name, std::string_view media_type,
                                            std::span<const std::byte> data, std::uint64_t log_time_ns,
                                            std::uint64_t create_time_ns) {
  return impl_->write_attachment(name, media_type, data, log_time_ns, create_time_ns);
}

Expected<void> McapWriter::write_metadata(std::string_view name, const std::map<std::string, std::string>& values) {
  return impl_->write_metadata(name, values);
}

Expected<void> McapWriter::flush() { return impl_->flush(); }
Expected<void> McapWriter::finish() { return impl_->finish(); }

}  // namespace perimap

// The records of an MCAP file, by their place in it.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/error/expected.hpp"
#include "drivers/recording/byte_source.hpp"
#include "drivers/recording/mcap_fields.hpp"
#include "drivers/recording/mcap_format.hpp"

namespace perimap::mcap {

using Buffer = std::vector<std::byte>;

// Whether these are the bytes that a recording begins and ends with.
[[nodiscard]] inline bool is_magic(std::span<const std::byte> bytes) {
  return std::equal(bytes.begin(), bytes.end(), kMagic.begin(), kMagic.end(),
                    [](std::byte a, std::uint8_t b) { return std::to_integer<std::uint8_t>(a) == b; });
}

// Every length is held against the size of the file before anything is allocated.
class McapFile {
 public:
  explicit McapFile(std::unique_ptr<ByteSource> source) : source_(std::move(source)), size_(source_->size()) {}

  [[nodiscard]] ByteSource& source() noexcept { return *source_; }
  [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
  Expected<void> read_at(std::uint64_t offset, std::span<std::byte> bytes) { return source_->read_at(offset, bytes); }

  // Header of the record at `offset` <= size_. The record lies whole within the file.
  [[nodiscard]] Expected<RecordHeader> record_header(std::uint64_t offset) {
    const std::uint64_t left = size_ - offset;
    if (left == 0) return fail_at(size_, "the recording ends before its data section does");
    if (left < kRecordHeaderBytes) {
      return fail_at(size_, fmt::format("the recording ends within the record header at byte {}", offset));
    }
    std::array<std::byte, kRecordHeaderBytes> bytes{};
    if (auto read = source_->read_at(offset, bytes); !read) return tl::unexpected(read.error());
    Cursor cursor(bytes);
    const RecordHeader header = take_record_header(cursor);
    if (header.length > left - kRecordHeaderBytes) {
      return fail_at(offset, fmt::format("a record of kind 0x{:02x} claims {} bytes, but the recording ends at byte {}",
                                         static_cast<unsigned>(header.opcode), header.length, size_));
    }
    return header;
  }

  // The record's content. `length` has been held against the size of the file.
  [[nodiscard]] Expected<Buffer> content(std::uint64_t offset, std::uint64_t length) {
    Buffer bytes(static_cast<std::size_t>(length));
    if (auto read = source_->read_at(offset + kRecordHeaderBytes, bytes); !read) {
      return tl::unexpected(read.error());
    }
    return bytes;
  }

  // The first place from `from` on that looks like a zstd chunk within the file; nullopt when there is none. What it
  // finds is only a guess: the chunk's CRC decides.
  [[nodiscard]] Expected<std::optional<std::uint64_t>> find_chunk(std::uint64_t from) {
    // The compression field as it stands in a chunk: length 4, "zstd", behind opcode, length, 3 sizes and a CRC.
    constexpr std::array<char, 8> kPattern{4, 0, 0, 0, 'z', 's', 't', 'd'};
    constexpr std::uint64_t kPatternOffset = kRecordHeaderBytes + 8 + 8 + 8 + 4;
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
        const auto header = record_header(candidate);
        if (header && header->opcode == Opcode::kChunk) return std::optional(candidate);
      }
    }
    return std::optional<std::uint64_t>();
  }

 private:
  std::unique_ptr<ByteSource> source_;
  std::uint64_t size_;
};

}  // namespace perimap::mcap

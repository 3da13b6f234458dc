#include "drivers/recording/mcap_chunk.hpp"

#include <fmt/format.h>
#include <zstd.h>

#include <string_view>

#include "drivers/recording/crc32.hpp"
#include "drivers/recording/mcap_fields.hpp"
#include "drivers/recording/mcap_format.hpp"

namespace perimap::mcap {
namespace {

// A zstd block takes 4 bytes at least and unpacks to 128 KiB at most (RFC 8878 §3.1.1.2), so no honest chunk is packed
// tighter than this.
constexpr std::uint64_t kMaxZstdRatio = (std::uint64_t{128} << 10) / 4;

}  // namespace

ChunkUnpacker::ChunkUnpacker() : context_(ZSTD_createDCtx()) {}

void ChunkUnpacker::FreeContext::operator()(ZSTD_DCtx_s* context) const noexcept { ZSTD_freeDCtx(context); }

Expected<void> ChunkUnpacker::unpack(std::span<const std::byte> content, std::uint64_t offset,
                                     std::vector<std::byte>& unpacked) {
  Cursor cursor(content);
  cursor.take_bytes(8 + 8);  // first and last message time
  const auto uncompressed_size = cursor.take<std::uint64_t>();
  const auto uncompressed_crc = cursor.take<std::uint32_t>();
  const std::string_view compression = cursor.take_string();
  const auto records = cursor.take_bytes(cursor.take<std::uint64_t>());
  if (!cursor.ok()) return fail_at(offset, "the chunk's fields do not fit its length");
  if (uncompressed_size > kMaxChunkBytes) {
    return fail_at(offset, fmt::format("the chunk claims to unpack to {} bytes, more than the limit of {}",
                                       uncompressed_size, kMaxChunkBytes));
  }
  if (compression.empty()) {
    if (uncompressed_size != records.size()) return fail_at(offset, "the chunk's two sizes do not agree");
    unpacked.assign(records.begin(), records.end());
  } else if (compression == kZstd) {
    if (uncompressed_size > records.size() * kMaxZstdRatio) {
      return fail_at(offset, fmt::format("{} bytes of zstd cannot unpack to {}", records.size(), uncompressed_size));
    }
    unpacked.resize(static_cast<std::size_t>(uncompressed_size));
    const std::size_t size =
        ZSTD_decompressDCtx(context_.get(), unpacked.data(), unpacked.size(), records.data(), records.size());
    if (ZSTD_isError(size) != 0) {
      return fail_at(offset, fmt::format("the chunk does not unpack: {}", ZSTD_getErrorName(size)));
    }
    if (size != unpacked.size()) {
      return fail_at(offset, fmt::format("the chunk unpacks to {} bytes, not {}", size, unpacked.size()));
    }
  } else {
    return fail_at(offset, fmt::format("the chunk's compression \"{}\" is not supported", compression));
  }
  if (uncompressed_crc != 0) {
    const std::uint32_t crc = crc32_update(0, unpacked);
    if (crc != uncompressed_crc) {
      return fail_at(offset, fmt::format("the chunk's CRC is {:08x}, stored is {:08x}", crc, uncompressed_crc));
    }
  }
  return {};
}

}  // namespace perimap::mcap

#include "drivers/recording/mcap_attachment.hpp"

#include <fmt/format.h>

#include "drivers/recording/crc32.hpp"
#include "drivers/recording/mcap_fields.hpp"

namespace perimap::mcap {

Expected<McapAttachment> parse_attachment(std::span<const std::byte> content, std::uint64_t offset) {
  Cursor cursor(content);
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
    const std::uint32_t crc = crc32_update(0, content.first(covered));
    if (crc != stored_crc) {
      return fail_at(offset, fmt::format("the attachment's CRC is {:08x}, stored is {:08x}", crc, stored_crc));
    }
  }
  attachment.data.assign(data.begin(), data.end());
  return attachment;
}

}  // namespace perimap::mcap

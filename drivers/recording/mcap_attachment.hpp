// An attachment's record.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/error/expected.hpp"
#include "drivers/recording/mcap_format.hpp"

namespace perimap::mcap {

// `content` of the record at byte `offset` of the file; its CRC, where there is one, is checked.
[[nodiscard]] Expected<McapAttachment> parse_attachment(std::span<const std::byte> content, std::uint64_t offset);

}  // namespace perimap::mcap

// CRC-32 as MCAP uses it: polynomial 0xEDB88320, initial value and final inversion as in zlib.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace perimap {

// Goes on from `crc`, the CRC of the bytes before (0 when there are none).
[[nodiscard]] std::uint32_t crc32_update(std::uint32_t crc, std::span<const std::byte> bytes) noexcept;

}  // namespace perimap

// CRC-32 as MCAP uses it: polynomial 0xEDB88320, initial value and final inversion as in zlib.
#pragma once

#include <zlib.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace perimap {

// Goes on from `crc`, the CRC of the bytes before (0 when there are none).
[[nodiscard]] inline std::uint32_t crc32_update(std::uint32_t crc, std::span<const std::byte> bytes) noexcept {
  // zlib takes a null pointer, which an empty span may hold, as a call for the initial value.
  if (bytes.empty()) return crc;
  return static_cast<std::uint32_t>(crc32_z(crc, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

}  // namespace perimap

#include "drivers/recording/crc32.hpp"

// By carry-less multiplication where the processor has it: a frame goes through two CRCs on its way to the disk.
#include <libdeflate.h>

namespace perimap {

std::uint32_t crc32_update(std::uint32_t crc, std::span<const std::byte> bytes) noexcept {
  // A null pointer, which an empty span may hold, is taken as a call for the initial value.
  if (bytes.empty()) return crc;
  return libdeflate_crc32(crc, bytes.data(), bytes.size());
}

}  // namespace perimap

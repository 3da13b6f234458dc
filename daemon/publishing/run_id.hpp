// Tells one run of a program from another.
#pragma once

#include <array>
#include <cstdint>
#include <random>

namespace perimap {

using RunId = std::array<std::uint8_t, 16>;

// A random UUID (RFC 9562, version 4) of the system's own randomness.
[[nodiscard]] inline RunId new_run_id() {
  std::random_device random;
  RunId id{};
  for (std::uint8_t& byte : id) byte = static_cast<std::uint8_t>(random());
  id[6] = static_cast<std::uint8_t>(0x40U | (id[6] & 0x0fU));
  id[8] = static_cast<std::uint8_t>(0x80U | (id[8] & 0x3fU));
  return id;
}

}  // namespace perimap

// SHA-256 (FIPS 180-4).
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

namespace perimap {

using Digest = std::array<std::uint8_t, 32>;

// Of the parts one after the other.
[[nodiscard]] Digest digest_of(std::initializer_list<std::string_view> parts);

[[nodiscard]] inline std::string_view bytes_of(const Digest& digest) {
  return {reinterpret_cast<const char*>(digest.data()), digest.size()};
}

// 64 hexadecimal digits, and back; nothing of what is none.
[[nodiscard]] std::string hex_of(const Digest& digest);
[[nodiscard]] std::optional<Digest> digest_of_hex(std::string_view text);

}  // namespace perimap

// Reads numbers from a message, in its byte order, and never past its end.
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace perimap {

// Reading past the end gives zeros and makes good() false for good: a parser reads on and asks once.
template <std::endian Order>
class ByteCursor {
 public:
  explicit ByteCursor(std::span<const std::byte> bytes) noexcept : bytes_(bytes) {}

  [[nodiscard]] bool good() const noexcept { return good_; }
  [[nodiscard]] std::size_t left() const noexcept { return bytes_.size(); }

  std::span<const std::byte> read_bytes(std::size_t count) noexcept {
    if (count > bytes_.size()) {
      good_ = false;
      bytes_ = {};
      return {};
    }
    const auto taken = bytes_.first(count);
    bytes_ = bytes_.subspan(count);
    return taken;
  }

  template <std::unsigned_integral T>
  T number() noexcept {
    const auto taken = read_bytes(sizeof(T));
    T value = 0;
    for (std::size_t i = 0; i < taken.size(); ++i) {
      const std::size_t at = Order == std::endian::little ? taken.size() - 1 - i : i;
      value = static_cast<T>((static_cast<std::uint64_t>(value) << 8U) | static_cast<std::uint64_t>(taken[at]));
    }
    return value;
  }
  float float32() noexcept { return std::bit_cast<float>(number<std::uint32_t>()); }

 private:
  std::span<const std::byte> bytes_;
  bool good_ = true;
};

}  // namespace perimap

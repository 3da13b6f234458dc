// Replies of NDI's Combined API: "Polaris Family Application Program Interface Guide", NDI IL-1070101, and "Polaris
// Vega Application Program Interface Guide", NDI IL-1070259.
//
//   text    OKAYA896\r            characters, CRC as four hexadecimal digits, CR; failures say ERRORxx or WARNINGxx
//   binary  C4 A5 ll ll hh hh ... cc cc    little-endian: length of the body, CRC of the four bytes before, body, its
//   CRC
//           C8 A5 ll ll ll ll hh hh ... cc cc    the same with a length of four bytes
//
// The CRC is CRC-16/ARC (reflected polynomial 0xA001, initial 0).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace perimap {

[[nodiscard]] std::uint16_t ndi_crc(std::span<const std::byte> bytes) noexcept;
// "INIT:" to "INIT:E3A5\r".
[[nodiscard]] std::string ndi_with_crc(std::string_view text);

struct NdiText {
  std::string text;  // without CRC
};
struct NdiBinary {
  std::vector<std::byte> body;
};
struct NdiDamaged {
  std::string what;
};
using NdiReply = std::variant<NdiText, NdiBinary, NdiDamaged>;

// Takes bytes in any chunks. A damaged reply leaves no way to tell where the next begins, so what is there is thrown
// away with it; the session then asks again.
class NdiReplyFramer {
 public:
  void restart() noexcept { pending_.clear(); }
  void feed(std::span<const std::byte> bytes) { pending_.insert(pending_.end(), bytes.begin(), bytes.end()); }
  // The next whole reply; none when more bytes must come.
  [[nodiscard]] std::optional<NdiReply> next();

 private:
  [[nodiscard]] std::optional<NdiReply> next_binary(std::size_t length_bytes);
  [[nodiscard]] std::optional<NdiReply> next_text();
  [[nodiscard]] NdiReply damaged(std::string what);

  std::vector<std::byte> pending_;
};

}  // namespace perimap

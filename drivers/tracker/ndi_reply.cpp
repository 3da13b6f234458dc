#include "drivers/tracker/ndi_reply.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "drivers/device/byte_cursor.hpp"

namespace perimap {
namespace {

constexpr std::byte kSecondByte{0xA5};
constexpr std::byte kShortReply{0xC4};
constexpr std::byte kLongReply{0xC8};
constexpr std::size_t kLongestBody = 64 * 1024;
constexpr std::size_t kLongestText = 8 * 1024;
constexpr std::size_t kTextCrc = 4;

constexpr std::array<std::uint16_t, 256> kTable = [] {
  std::array<std::uint16_t, 256> table{};
  for (unsigned i = 0; i < 256; ++i) {
    unsigned crc = i;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? crc >> 1U ^ 0xA001U : crc >> 1U;
    table[i] = static_cast<std::uint16_t>(crc);
  }
  return table;
}();

}  // namespace

std::uint16_t ndi_crc(std::span<const std::byte> bytes) noexcept {
  unsigned crc = 0;
  for (const std::byte b : bytes) crc = crc >> 8U ^ kTable[(crc ^ std::to_integer<unsigned>(b)) & 0xFFU];
  return static_cast<std::uint16_t>(crc);
}

std::string ndi_with_crc(std::string_view text) {
  return fmt::format("{}{:04X}\r", text, ndi_crc(std::as_bytes(std::span(text.data(), text.size()))));
}

std::optional<NdiReply> NdiReplyFramer::next() {
  if (pending_.empty()) return std::nullopt;
  if (pending_[0] != kShortReply && pending_[0] != kLongReply) return next_text();
  if (pending_.size() < 2) return std::nullopt;
  if (pending_[1] != kSecondByte) return damaged("neither a text nor a binary reply");
  return next_binary(pending_[0] == kShortReply ? 2 : 4);
}

std::optional<NdiReply> NdiReplyFramer::next_binary(std::size_t length_bytes) {
  const std::size_t header = 2 + length_bytes;
  if (pending_.size() < header + 2) return std::nullopt;
  ByteCursor<std::endian::little> cursor(pending_);
  cursor.read_bytes(2);
  const std::size_t length = length_bytes == 2 ? cursor.number<std::uint16_t>() : cursor.number<std::uint32_t>();
  const auto header_crc = cursor.number<std::uint16_t>();
  if (header_crc != ndi_crc(std::span(pending_).first(header))) return damaged("header CRC");
  if (length > kLongestBody) return damaged(fmt::format("{} bytes of body", length));
  if (cursor.left() < length + 2) return std::nullopt;
  const auto body = cursor.read_bytes(length);
  if (cursor.number<std::uint16_t>() != ndi_crc(body)) return damaged("body CRC");
  NdiBinary reply{{body.begin(), body.end()}};
  pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(header + 2 + length + 2));
  return reply;
}

std::optional<NdiReply> NdiReplyFramer::next_text() {
  const auto end = std::find(pending_.begin(), pending_.end(), std::byte{'\r'});
  if (end == pending_.end()) {
    if (pending_.size() > kLongestText) return damaged("a text without end");
    return std::nullopt;
  }
  std::string line;
  for (auto it = pending_.begin(); it != end; ++it) line.push_back(static_cast<char>(*it));
  if (line.size() <= kTextCrc) return damaged("a text too short for its CRC");
  const std::string_view digits = std::string_view(line).substr(line.size() - kTextCrc);
  std::uint16_t crc = 0;
  const auto [stop, error] = std::from_chars(digits.data(), digits.data() + kTextCrc, crc, 16);
  const auto text = std::string_view(line).substr(0, line.size() - kTextCrc);
  // The device's digits are capital letters; others are damaged ones.
  const bool capitals = std::none_of(digits.begin(), digits.end(), [](char c) { return c >= 'a' && c <= 'f'; });
  if (!capitals || error != std::errc{} || stop != digits.data() + kTextCrc ||
      crc != ndi_crc(std::as_bytes(std::span(text.data(), text.size())))) {
    return damaged("text CRC");
  }
  NdiText reply{std::string(text)};
  pending_.erase(pending_.begin(), end + 1);
  return reply;
}

NdiReply NdiReplyFramer::damaged(std::string what) {
  pending_.clear();
  return NdiDamaged{std::move(what)};
}

}  // namespace perimap

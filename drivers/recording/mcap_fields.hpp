// The fields of MCAP records, bounds-checked, and the records that both the data section and its summary have.
#pragma once

#include <fmt/format.h>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "core/error/expected.hpp"
#include "drivers/recording/mcap_format.hpp"

namespace perimap::mcap {

// "byte N: what is wrong", N counted from the start of the file.
inline tl::unexpected<Error> fail_at(std::uint64_t byte, std::string_view what) {
  return fail(fmt::format("byte {}: {}", byte, what));
}

// Bounds-checked little-endian fields. Once a field did not fit, every later one is empty and ok() is false.
class Cursor {
 public:
  explicit Cursor(std::span<const std::byte> bytes) noexcept : bytes_(bytes) {}

  template <std::unsigned_integral U>
  U take() noexcept {
    const auto bytes = take_bytes(sizeof(U));
    U value = 0;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      value = static_cast<U>(value | static_cast<U>(std::to_integer<U>(bytes[i]) << (8 * i)));
    }
    return value;
  }

  std::span<const std::byte> take_bytes(std::uint64_t count) noexcept {
    if (!ok_ || count > left()) {
      ok_ = false;
      return {};
    }
    const auto taken = bytes_.subspan(at_, static_cast<std::size_t>(count));
    at_ += taken.size();
    return taken;
  }

  std::string_view take_string() noexcept {
    const auto bytes = take_bytes(take<std::uint32_t>());
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }

  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] std::size_t at() const noexcept { return at_; }
  [[nodiscard]] std::size_t left() const noexcept { return bytes_.size() - at_; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

struct RecordHeader {
  Opcode opcode{};
  std::uint64_t length = 0;  // of the content
};

inline RecordHeader take_record_header(Cursor& cursor) {
  const auto opcode = static_cast<Opcode>(cursor.take<std::uint8_t>());
  return {opcode, cursor.take<std::uint64_t>()};
}

inline std::optional<McapSchema> parse_schema(std::span<const std::byte> content) {
  Cursor cursor(content);
  McapSchema schema;
  schema.id = cursor.take<std::uint16_t>();
  schema.name = cursor.take_string();
  schema.encoding = cursor.take_string();
  schema.data = cursor.take_string();
  if (!cursor.ok() || schema.id == 0) return std::nullopt;
  return schema;
}

inline std::optional<McapChannel> parse_channel(std::span<const std::byte> content) {
  Cursor cursor(content);
  McapChannel channel;
  channel.id = cursor.take<std::uint16_t>();
  channel.schema_id = cursor.take<std::uint16_t>();
  channel.topic = cursor.take_string();
  channel.message_encoding = cursor.take_string();
  Cursor metadata(cursor.take_bytes(cursor.take<std::uint32_t>()));
  while (cursor.ok() && metadata.ok() && metadata.left() > 0) {
    const std::string_view key = metadata.take_string();
    channel.metadata.emplace(key, metadata.take_string());
  }
  if (!cursor.ok() || !metadata.ok()) return std::nullopt;
  return channel;
}

inline constexpr std::size_t kMessageHeaderBytes = 2 + 4 + 8 + 8;

inline std::optional<McapMessage> parse_message(std::span<const std::byte> content) {
  Cursor cursor(content);
  McapMessage message;
  message.channel_id = cursor.take<std::uint16_t>();
  message.sequence = cursor.take<std::uint32_t>();
  message.log_time_ns = cursor.take<std::uint64_t>();
  message.publish_time_ns = cursor.take<std::uint64_t>();
  if (!cursor.ok()) return std::nullopt;
  message.data = content.subspan(kMessageHeaderBytes);
  return message;
}

}  // namespace perimap::mcap

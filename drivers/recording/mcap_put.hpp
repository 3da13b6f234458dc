// Writes the fields of MCAP records, and the records that both the data section and its summary have.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/recording/mcap_format.hpp"

namespace perimap::mcap {

using Buffer = std::vector<std::byte>;

inline void put(Buffer& out, std::span<const std::byte> bytes) { out.insert(out.end(), bytes.begin(), bytes.end()); }

template <std::unsigned_integral U>
void put(Buffer& out, U value) {
  for (std::size_t i = 0; i < sizeof(U); ++i) out.push_back(static_cast<std::byte>(value >> (8 * i)));
}

template <std::unsigned_integral U>
void put_at(Buffer& out, std::size_t at, U value) {
  for (std::size_t i = 0; i < sizeof(U); ++i) out[at + i] = static_cast<std::byte>(value >> (8 * i));
}

// Lengths are checked before a record is built (add_schema and the like), so the narrowing here is exact.
inline void put(Buffer& out, std::string_view text) {
  put(out, static_cast<std::uint32_t>(text.size()));
  put(out, std::as_bytes(std::span(text)));
}

// Puts a 4-byte length in front of what `fill` writes.
template <class Fill>
void put_block(Buffer& out, Fill fill) {
  const std::size_t start = out.size();
  put(out, std::uint32_t{0});
  fill();
  put_at(out, start, static_cast<std::uint32_t>(out.size() - start - 4));
}

inline void put(Buffer& out, const std::map<std::string, std::string>& values) {
  put_block(out, [&] {
    for (const auto& [key, value] : values) {
      put(out, key);
      put(out, value);
    }
  });
}

// Opcode and length around what `fill` writes.
template <class Fill>
void put_record(Buffer& out, Opcode opcode, Fill fill) {
  const std::size_t start = out.size();
  put(out, static_cast<std::uint8_t>(opcode));
  put(out, std::uint64_t{0});
  fill();
  put_at(out, start + 1, static_cast<std::uint64_t>(out.size() - start - kRecordHeaderBytes));
}

inline void put(Buffer& out, const McapSchema& schema) {
  put_record(out, Opcode::kSchema, [&] {
    put(out, schema.id);
    put(out, std::string_view(schema.name));
    put(out, std::string_view(schema.encoding));
    put(out, std::string_view(schema.data));
  });
}

inline void put(Buffer& out, const McapChannel& channel) {
  put_record(out, Opcode::kChannel, [&] {
    put(out, channel.id);
    put(out, channel.schema_id);
    put(out, std::string_view(channel.topic));
    put(out, std::string_view(channel.message_encoding));
    put(out, channel.metadata);
  });
}

}  // namespace perimap::mcap

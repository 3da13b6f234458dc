#include "daemon/black_box/entry.hpp"

#include <array>
#include <bit>

namespace perimap::black_box {
namespace {

template <class T>
void append(std::string& bytes, T value) {
  static_assert(std::endian::native == std::endian::little);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

std::string_view kind_name(EntryKind kind) noexcept {
  constexpr std::array<std::string_view, 12> kNames = {"nothing", "header", "configuration", "surface",
                                                       "phase",   "status", "command",       "event",
                                                       "log",     "lost",   "let go",        "end"};
  const auto index = static_cast<std::size_t>(kind);
  return index < kNames.size() ? kNames[index] : kNames[0];
}

std::string segment_begin() {
  std::string bytes(kSegmentMagic);
  append(bytes, kSegmentFormat);
  return bytes;
}

Digest begin_digest() { return digest_of({segment_begin()}); }

std::string frame_of(const Entry& entry, Digest& chain) {
  std::string bytes;
  bytes.reserve(entry.content.size() + kEntryFrame);
  append(bytes, static_cast<std::uint32_t>(entry.content.size()));
  append(bytes, static_cast<std::uint32_t>(entry.kind));  // the kind, and three zeros
  append(bytes, entry.at.monotonic_ns);
  append(bytes, entry.at.utc_ns);
  bytes.append(entry.content);
  chain = digest_of({bytes_of(chain), bytes});
  bytes.append(bytes_of(chain));
  return bytes;
}

}  // namespace perimap::black_box

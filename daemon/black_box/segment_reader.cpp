#include "daemon/black_box/segment_reader.hpp"

#include <fmt/format.h>

#include <bit>
#include <span>

#include "drivers/device/byte_cursor.hpp"

namespace perimap::black_box {
namespace {

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Entries one after the other, each held against its digest.
class Walk {
 public:
  Walk(std::string_view bytes, SegmentFacts& facts) : all_(bytes), facts_(facts) {}

  // Whether the segment begins as one.
  bool begin() {
    const std::string begin = segment_begin();
    if (all_.empty()) return stop("expected a segment of a black box, got an empty file");
    if (all_.size() < begin.size() || all_.substr(0, begin.size()) != begin) {
      if (begin.starts_with(all_)) facts_.torn = true;
      return stop(fmt::format("expected '{}' and format {}, got something else", kSegmentMagic, kSegmentFormat));
    }
    facts_.bytes = begin.size();
    facts_.digest = begin_digest();
    return true;
  }

  // The next entry, or nothing: facts say why.
  bool next(Entry& entry) {
    const std::string_view rest = all_.substr(facts_.bytes);
    if (rest.empty()) return false;
    if (facts_.ended) return stop("expected nothing behind the entry that ends the segment");
    ByteCursor<std::endian::little> cursor(std::as_bytes(std::span(rest.data(), rest.size())));
    const auto length = cursor.number<std::uint32_t>();
    const auto kind = cursor.number<std::uint32_t>();
    entry.at.monotonic_ns = static_cast<std::int64_t>(cursor.number<std::uint64_t>());
    entry.at.utc_ns = static_cast<std::int64_t>(cursor.number<std::uint64_t>());
    if (!cursor.good()) return tear(rest.size(), kEntryFrame);
    if (length > kLongestContent) {
      return stop(fmt::format("expected at most {} bytes in an entry, got {}", kLongestContent, length));
    }
    if (kind < 1 || kind > static_cast<std::uint32_t>(kLastKind)) {
      return stop(fmt::format("expected a kind of entry from 1 to {}, got {}", static_cast<unsigned>(kLastKind), kind));
    }
    entry.kind = static_cast<EntryKind>(kind);
    entry.content = text_of(cursor.read_bytes(length));
    const std::string_view told = text_of(cursor.read_bytes(sizeof(Digest)));
    if (!cursor.good()) return tear(rest.size(), kEntryFrame + length);
    const Digest digest = digest_of({bytes_of(facts_.digest), rest.substr(0, kEntryHead + length)});
    if (told != bytes_of(digest)) {
      return stop("its digest does not fit: it, or one before it, is not as it was written");
    }
    if ((facts_.entries == 0) != (entry.kind == EntryKind::kHeader)) {
      return stop("expected a header as the first entry, and nowhere else");
    }
    digest_ = digest;
    size_ = kEntryFrame + length;
    return true;
  }

  void count(const Entry& entry) {
    facts_.digest = digest_;
    facts_.bytes += size_;
    facts_.last_utc_ns = entry.at.utc_ns;
    if (facts_.entries++ == 0) facts_.first_utc_ns = entry.at.utc_ns;
    facts_.ended = entry.kind == EntryKind::kEnd;
  }

  bool stop(std::string_view why) {
    facts_.fault = fmt::format("entry {}, byte {}: {}", facts_.entries, facts_.bytes, why);
    return false;
  }

 private:
  bool tear(std::size_t there, std::size_t expected) {
    facts_.torn = true;
    return stop(fmt::format("expected an entry of {} bytes or more, got {} bytes to the end", expected, there));
  }

  std::string_view all_;
  SegmentFacts& facts_;
  Digest digest_{};
  std::size_t size_ = 0;
};

}  // namespace

SegmentFacts read_segment(std::string_view bytes, const std::function<void(const Entry&)>& see) {
  SegmentFacts facts;
  Walk walk(bytes, facts);
  if (!walk.begin()) return facts;
  Entry entry;
  while (walk.next(entry)) {
    if (entry.kind == EntryKind::kHeader) {
      auto header = parse_header(entry.content);
      if (!header) {
        walk.stop(header.error().message);
        break;
      }
      facts.header = std::move(*header);
    }
    walk.count(entry);
    if (see) see(entry);
  }
  if (facts.entries == 0 && facts.fault.empty()) {
    facts.torn = true;
    walk.stop("expected a header, got the end");
  }
  return facts;
}

}  // namespace perimap::black_box

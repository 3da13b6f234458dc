// Any bytes as a segment of a black box: what is said of it, and its entries as text. With digests that fit, too, which
// would keep the fuzzer out.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "daemon/black_box/entry.hpp"
#include "daemon/black_box/entry_text.hpp"
#include "daemon/black_box/segment_reader.hpp"
#include "daemon/black_box/segment_ring.hpp"

namespace {

using namespace perimap::black_box;

void read(std::string_view bytes) {
  std::uint64_t entries = 0;
  const SegmentFacts facts = read_segment(bytes, [&entries](const Entry& entry) {
    ++entries;
    static_cast<void>(json_of(entry));
    static_cast<void>(let_go_number(entry.content));
    static_cast<void>(why_of(entry.content));
  });
  if (facts.entries != entries || facts.bytes > bytes.size()) std::abort();
  if (facts.whole() && facts.bytes != bytes.size()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  read(bytes);
  // The first byte is a kind, the second the length of what follows, and so on.
  std::string segment = segment_begin();
  perimap::Digest chain = begin_digest();
  for (std::size_t i = 0; i + 2 <= size;) {
    const std::size_t length = std::size_t{data[i + 1]} << (data[i] >> 5U);
    const auto kind = static_cast<EntryKind>(data[i] & 0x1fU);
    segment += frame_of({kind, {1, 2}, bytes.substr(i + 2, length)}, chain);
    i += 2 + length;
  }
  read(segment);
  return 0;
}

// Any bytes as a recording, read in both modes to the end, with every attachment and every message decoded.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "drivers/recording/recording_reader.hpp"
#include "tests/unit/recording/every_type.hpp"
#include "tests/unit/recording/memory_file.hpp"

namespace perimap {
namespace {

void read_all(std::span<const std::byte> bytes, ReadMode mode) {
  auto reader = RecordingReader::open(test::source_of(bytes), "fuzz.mcap", mode);
  if (!reader) return;
  for (const std::string& name : reader->attachment_names()) static_cast<void>(reader->attachment(name));
  while (true) {
    const auto message = reader->next();
    if (!message && mode == ReadMode::kWhole) std::abort();  // damage must not end the reading
    if (!message || !*message) break;
    test::for_every_type([&]<class T>() {
      if ((*message)->type == topic_type<T>().schema_name()) static_cast<void>(reader->decode<T>(**message));
    });
  }
}

}  // namespace
}  // namespace perimap

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  perimap::read_all(bytes, perimap::ReadMode::kStrict);
  perimap::read_all(bytes, perimap::ReadMode::kWhole);
  return 0;
}

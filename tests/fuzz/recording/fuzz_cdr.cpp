// Any bytes as a message of any type (the first byte chooses): an error, or a sample that goes through bytes unchanged.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "drivers/json/json_text.hpp"
#include "drivers/recording/cdr.hpp"
#include "tests/unit/recording/every_type.hpp"
#include "tests/unit/recording/samples.hpp"

namespace perimap {
namespace {

template <class T>
void round_trip(std::span<const std::byte> bytes) {
  const auto sample = deserialize<T>(bytes);
  if (!sample) return;
  CdrSerializer serializer;
  const auto again = serializer.serialize(**sample);
  if (!again) std::abort();
  const auto second = deserialize<T>(*again);
  // As text, because a NaN does not equal itself.
  if (!second || json_line(test::to_json(**second)) != json_line(test::to_json(**sample))) {
    std::abort();
  }
}

}  // namespace
}  // namespace perimap

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto bytes = std::as_bytes(std::span(data, size));
  unsigned type = 0;
  perimap::test::for_every_type([&]<class T>() {
    if (type++ == data[0]) perimap::round_trip<T>(bytes.subspan(1));
  });
  return 0;
}

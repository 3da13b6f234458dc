// Any bytes as a configuration file: an error of one line, or a configuration that prints and loads back to itself.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "daemon/config/configuration_loader.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const Expected<Configuration> result = parse_configuration(text, "fuzz.toml", {}, NamedFiles::kMayBeMissing);
  if (!result) {
    if (result.error().message.find_first_of("\r\n") != std::string::npos) std::abort();
    return 0;
  }
  Expected<Configuration> again = parse_configuration(to_toml(*result), "again.toml", {}, NamedFiles::kMayBeMissing);
  if (!again) std::abort();
  // Angles are printed in degrees to 15 digits.
  const double difference_rad = again->tracker.rotation_deviation_rad - result->tracker.rotation_deviation_rad;
  if (difference_rad > 1e-14 || difference_rad < -1e-14) std::abort();
  again->tracker.rotation_deviation_rad = result->tracker.rotation_deviation_rad;
  if (!(*again == *result)) std::abort();
  return 0;
}

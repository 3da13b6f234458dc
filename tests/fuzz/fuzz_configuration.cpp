// Any bytes as a configuration file: errors of a line each, or a configuration that prints and loads back to itself. As
// a recording brings them along, they change nothing but what describes the session.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <sstream>
#include <string>
#include <string_view>

#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/configuration_text.hpp"
#include "daemon/config/session_keys.hpp"

namespace {

bool names_the_file_on_every_line(const std::string& message) {
  std::istringstream lines(message + "\n");
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("fuzz.toml:") || line.find('\r') != std::string::npos) return false;
  }
  return true;
}

// What stays as it was does so for each key that a recording may not set.
void check_recorded(std::string_view text) {
  using namespace perimap;
  const auto recorded = parse_recorded_configuration(text, "fuzz.toml", {}, OtherKeys::kPassedOver);
  if (!recorded) return;
  for (const ConfigurationKey& key : configuration_keys()) {
    if (!describes_session(key) && key.write(recorded->configuration) != key.write({})) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  check_recorded(text);
  const Expected<Configuration> result = parse_configuration(text, "fuzz.toml", {}, NamedFiles::kMayBeMissing);
  if (!result) {
    if (!names_the_file_on_every_line(result.error().message)) std::abort();
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

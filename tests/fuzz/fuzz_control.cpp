// Any bytes as a request to a running perimapd: a command that is read back by its name, or an error of one printable
// line.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "daemon/control/control_request.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  const std::string_view request(reinterpret_cast<const char*>(data), size);
  const Expected<ControlCommand> command = parse_control_request(request);
  if (command) {
    if (std::string(name_of(*command)) + "\n" != request) std::abort();
    return 0;
  }
  const std::string& message = command.error().message;
  if (!std::all_of(message.begin(), message.end(), [](char c) { return c >= ' ' && c <= '~'; })) std::abort();
  return 0;
}

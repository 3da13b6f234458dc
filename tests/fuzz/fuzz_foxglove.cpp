// Any bytes as what a viewer asks of perimap bridge foxglove: read, or refused in one printable line.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "daemon/bridge/foxglove_protocol/foxglove_protocol.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto request = perimap::parse_foxglove_request({reinterpret_cast<const char*>(data), size});
  if (request) return 0;
  const std::string_view message = request.error().message;
  if (message.empty() || !std::all_of(message.begin(), message.end(), [](char c) { return c >= ' ' && c <= '~'; })) {
    std::abort();
  }
  return 0;
}

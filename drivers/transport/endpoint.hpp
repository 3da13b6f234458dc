// Where a device is, as a user writes it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

#include "core/error/expected.hpp"

namespace perimap {

struct SerialEndpoint {
  std::string path;
  bool operator==(const SerialEndpoint&) const = default;
};
struct TcpEndpoint {
  std::string host;
  std::uint16_t port = 0;
  bool operator==(const TcpEndpoint&) const = default;
};
struct CanEndpoint {
  std::string interface_name;
  bool operator==(const CanEndpoint&) const = default;
};
using Endpoint = std::variant<SerialEndpoint, TcpEndpoint, CanEndpoint>;

// "/dev/ttyUSB0" (any absolute path), "tcp:HOST:PORT" ("tcp:[::1]:8765" for a literal IPv6 address), "can:can0".
[[nodiscard]] Expected<Endpoint> parse_endpoint(std::string_view text);
[[nodiscard]] std::string format_endpoint(const Endpoint& endpoint);

}  // namespace perimap

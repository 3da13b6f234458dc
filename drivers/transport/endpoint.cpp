#include "drivers/transport/endpoint.hpp"

#include <fmt/format.h>
#include <linux/if.h>

#include <algorithm>
#include <charconv>

#include "core/error/one_line.hpp"

namespace perimap {
namespace {

constexpr std::string_view kTcp = "tcp:";
constexpr std::string_view kCan = "can:";

bool printable(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < 0x7F; });
}

}  // namespace

Expected<Endpoint> parse_endpoint(std::string_view text) {
  const auto refuse = [text] {
    return fail(on_one_line(
        fmt::format("expected an absolute path of a serial port, tcp:HOST:PORT or can:INTERFACE, got '{}'", text)));
  };
  if (text.starts_with('/') && text.find('\0') == std::string_view::npos) return SerialEndpoint{std::string(text)};
  if (text.starts_with(kCan)) {
    const std::string_view name = text.substr(kCan.size());
    if (name.empty() || name.size() >= IFNAMSIZ || !printable(name)) return refuse();
    return CanEndpoint{std::string(name)};
  }
  if (!text.starts_with(kTcp)) return refuse();
  text.remove_prefix(kTcp.size());
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos || colon == 0) return refuse();
  std::string_view host = text.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  const std::string_view digits = text.substr(colon + 1);
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
  if (error != std::errc{} || end != digits.data() + digits.size() || port == 0 || !printable(host)) return refuse();
  return TcpEndpoint{std::string(host), port};
}

std::string format_endpoint(const Endpoint& endpoint) {
  if (const auto* serial = std::get_if<SerialEndpoint>(&endpoint)) return serial->path;
  if (const auto* can = std::get_if<CanEndpoint>(&endpoint)) return fmt::format("{}{}", kCan, can->interface_name);
  const auto& tcp = std::get<TcpEndpoint>(endpoint);
  const bool literal_v6 = tcp.host.find(':') != std::string::npos;
  return literal_v6 ? fmt::format("{}[{}]:{}", kTcp, tcp.host, tcp.port)
                    : fmt::format("{}{}:{}", kTcp, tcp.host, tcp.port);
}

}  // namespace perimap

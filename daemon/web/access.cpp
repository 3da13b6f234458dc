#include "daemon/web/access.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <optional>
#include <system_error>

namespace perimap {
namespace {

constexpr std::size_t kLongestHost = 255;
constexpr std::string_view kOriginScheme = "http://";

// Whether the address, in numbers, is one of loopback; none: it is no address.
std::optional<bool> loopback_of(const std::string& text) {
  in_addr v4{};
  if (inet_pton(AF_INET, text.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24 == 127;
  in6_addr v6{};
  if (inet_pton(AF_INET6, text.c_str(), &v6) == 1) return IN6_IS_ADDR_LOOPBACK(&v6) != 0;
  return std::nullopt;
}

std::optional<std::uint16_t> port_of(std::string_view text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return port;
}

// Takes as long for a wrong token as for the right one.
bool same_token(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned different = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    different |= static_cast<unsigned>(static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]));
  }
  return different == 0;
}

std::string cookie_name(const Access& access) { return fmt::format("perimap_{}=", access.port); }

// Empty: there is none of ours.
std::string_view token_in(std::string_view cookies, const std::string& name) {
  while (!cookies.empty()) {
    const std::size_t end = std::min(cookies.find(';'), cookies.size());
    std::string_view cookie = cookies.substr(0, end);
    cookies.remove_prefix(std::min(end + 1, cookies.size()));
    while (!cookie.empty() && cookie.front() == ' ') cookie.remove_prefix(1);
    if (cookie.substr(0, name.size()) == name) return cookie.substr(name.size());
  }
  return {};
}

tl::unexpected<Denial> deny(unsigned status, std::string message) {
  return tl::unexpected(Denial{status, std::move(message)});
}

}  // namespace

Expected<HostName> parse_host(std::string_view host) {
  if (host.empty() || host.size() > kLongestHost) return fail("a request without a host's name, or with a long one");
  HostName parsed;
  std::string name;
  std::string_view rest;
  if (host.front() == '[') {
    const std::size_t end = host.find(']');
    if (end == std::string_view::npos) return fail("a host's name with '[' and no ']'");
    name = host.substr(1, end - 1);
    rest = host.substr(end + 1);
    if (name.find(':') == std::string::npos) return fail("a host's name in brackets that is no IPv6 address");
  } else {
    const std::size_t end = std::min(host.find(':'), host.size());
    name = host.substr(0, end);
    rest = host.substr(end);
  }
  if (name.empty() || name.find('\0') != std::string::npos) return fail("a request without a host's name");
  if (!rest.empty()) {
    const auto port = rest.front() == ':' ? port_of(rest.substr(1)) : std::nullopt;
    if (!port) return fail("a host's name with a port that is none");
    parsed.port = *port;
  }
  std::transform(name.begin(), name.end(), name.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  const auto loopback = name == "localhost" ? std::optional(true) : loopback_of(name);
  if (host.front() == '[' && !loopback) return fail("a host's name in brackets that is no IPv6 address");
  if (loopback) parsed.kind = *loopback ? HostName::Kind::kLoopback : HostName::Kind::kAddress;
  return parsed;
}

Expected<bool> is_loopback(const std::string& address) {
  const auto loopback = address.find('\0') == std::string::npos ? loopback_of(address) : std::nullopt;
  if (!loopback)
    return fail(fmt::format("expected an address in numbers, such as 127.0.0.1 or ::1, got '{}'", address));
  return *loopback;
}

tl::expected<RequestTarget, Denial> admit(const Access& access, const RequestHead& head) {
  const auto host = parse_host(head.host);
  if (!host) return deny(400, host.error().message);
  if (host->port != access.port || host->kind == HostName::Kind::kName ||
      (access.loopback && host->kind != HostName::Kind::kLoopback)) {
    return deny(403, "nothing is served under that name: open the address that was printed");
  }
  const bool own = head.origin.substr(0, kOriginScheme.size()) == kOriginScheme &&
                   head.origin.substr(kOriginScheme.size()) == head.host;
  if (!head.origin.empty() && !own &&
      std::find(access.origins.begin(), access.origins.end(), head.origin) == access.origins.end()) {
    return deny(403, "a page of elsewhere may not ask this");
  }
  auto target = parse_request_target(head.target);
  if (!target) return deny(head.target.size() > kLongestTarget ? 414 : 400, target.error().message);
  if (!access.token.empty() && !same_token(target->token, access.token) &&
      !same_token(token_in(head.cookie, cookie_name(access)), access.token)) {
    return deny(403, "the token is missing or wrong: open the address that was printed, with its token");
  }
  return *target;
}

std::string token_cookie(const Access& access) { return cookie_name(access) + access.token; }

Expected<std::string> make_token() {
  std::array<unsigned char, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    return fail(fmt::format("cannot draw a random token: {}", std::generic_category().message(errno)));
  }
  std::string token;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", static_cast<unsigned>(byte));
  return token;
}

}  // namespace perimap

// Whose request is answered.
//
// A page of another site, open in a browser of this host, can send requests here too. It cannot make the browser lie
// about `Host` (the name it believes to talk to: another's, when that name was made to point here) or `Origin` (whose
// page asks). Elsewhere than on loopback a token is asked for as well.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/web/request_target.hpp"

namespace perimap {

// A request's `Host`, RFC 9110 section 7.2.
struct HostName {
  enum class Kind { kLoopback, kAddress, kName };  // 127.x.y.z, ::1 or localhost; another address; a name
  Kind kind = Kind::kName;
  std::uint16_t port = 80;
};

// Any bytes are safe; an error is one printable line.
[[nodiscard]] Expected<HostName> parse_host(std::string_view host);

// An address in numbers, as 127.0.0.1 or ::1; whether it is one of loopback.
[[nodiscard]] Expected<bool> is_loopback(const std::string& address);

struct Access {
  bool loopback = true;
  std::uint16_t port = 0;
  std::string token;                 // empty: none is asked for
  std::vector<std::string> origins;  // of pages of elsewhere that may ask too
};

// The parts of a request that decide. Views are empty where a field is not there.
struct RequestHead {
  std::string_view target;
  std::string_view host;
  std::string_view origin;
  std::string_view cookie;
};

struct Denial {
  unsigned status = 403;  // of HTTP
  std::string message;    // one printable line, for a person
};

// What is asked for, or why it is not given.
[[nodiscard]] tl::expected<RequestTarget, Denial> admit(const Access& access, const RequestHead& head);

// The cookie that keeps the token once the address with it was opened: NAME=TOKEN. Its name has the port, since
// browsers give a host's cookies to all its ports.
[[nodiscard]] std::string token_cookie(const Access& access);

// 128 random bits in hexadecimal.
[[nodiscard]] Expected<std::string> make_token();

}  // namespace perimap

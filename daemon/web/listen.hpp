// How a server of this program begins to listen.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"

namespace perimap {

// `address` in numbers; port 0: any that is free. An error says which address it is, and what to do; `command` is what
// the user has run.
[[nodiscard]] Expected<void> listen_on(boost::asio::ip::tcp::acceptor& acceptor, const std::string& address,
                                       std::uint16_t port, std::string_view command);

}  // namespace perimap

#include "daemon/web/listen.hpp"

#include <fmt/format.h>

namespace perimap {
namespace {

namespace asio = boost::asio;

std::string why_not(const std::string& address, std::uint16_t port, std::string_view command,
                    const boost::system::error_code& error) {
  const std::string where = fmt::format("cannot listen on {} port {}: {}", address, port, error.message());
  if (error == asio::error::address_in_use) {
    return fmt::format("{}; is another {} running? Else choose another --port, or 0 for any that is free", where,
                       command);
  }
  if (error == asio::error::access_denied) return where + "; ports below 1024 are root's: choose another --port";
  return where + "; --bind takes an address of this host";
}

}  // namespace

Expected<void> listen_on(asio::ip::tcp::acceptor& acceptor, const std::string& address, std::uint16_t port,
                         std::string_view command) {
  boost::system::error_code error;
  const asio::ip::tcp::endpoint endpoint(asio::ip::make_address(address, error), port);
  if (!error) acceptor.open(endpoint.protocol(), error);
  // Connections that were there before do not keep the port.
  if (!error) acceptor.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) return fail(why_not(address, port, command, error));
  return {};
}

}  // namespace perimap

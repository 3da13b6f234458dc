// One connection of a browser, or of another client: files of the page, or the beginning of a WebSocket.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "daemon/web/access.hpp"
#include "daemon/web/web_service.hpp"

namespace perimap {

class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  using Request = boost::beast::http::request<boost::beast::http::empty_body>;
  // Takes over the connection of a request for the WebSocket that was admitted.
  using Upgrade = std::function<void(boost::beast::tcp_stream, Request, const std::string& subprotocol)>;

  // `open` counts the connections that there are. `access` and `service` must outlive this.
  HttpConnection(boost::asio::ip::tcp::socket socket, const Access& access, const WebService& service, Upgrade upgrade,
                 std::shared_ptr<std::size_t> open);
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;
  ~HttpConnection();

  void read();

 private:
  using Text = boost::beast::http::response<boost::beast::http::string_body>;

  void answer();
  void upgrade();
  void answer_with(const PageFile& file);
  void refuse(unsigned status, std::string_view why);
  void send(Text response);

  boost::beast::tcp_stream stream_;
  const Access& access_;
  const WebService& service_;
  Upgrade upgrade_;
  std::shared_ptr<std::size_t> open_;
  boost::beast::flat_buffer buffer_;
  std::optional<boost::beast::http::request_parser<boost::beast::http::empty_body>> parser_;
  std::shared_ptr<Text> response_;
};

}  // namespace perimap

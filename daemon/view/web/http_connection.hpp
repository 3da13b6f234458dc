// One connection of a browser: files of the page, or the beginning of a page's WebSocket.
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

#include "daemon/view/web/access.hpp"
#include "daemon/view/web/page_file.hpp"

namespace perimap {

class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  using Request = boost::beast::http::request<boost::beast::http::empty_body>;
  // Takes over the connection of a request for the page's WebSocket that was admitted.
  using Upgrade = std::function<void(boost::beast::tcp_stream, Request)>;

  // `open` counts the connections that there are. `access` must outlive this.
  HttpConnection(boost::asio::ip::tcp::socket socket, const Access& access, Upgrade upgrade,
                 std::shared_ptr<std::size_t> open);
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;
  ~HttpConnection();

  void read();

 private:
  using Text = boost::beast::http::response<boost::beast::http::string_body>;

  void answer();
  void answer_with(const PageFile& file);
  void refuse(unsigned status, std::string_view why);
  void send(Text response);

  boost::beast::tcp_stream stream_;
  const Access& access_;
  Upgrade upgrade_;
  std::shared_ptr<std::size_t> open_;
  boost::beast::flat_buffer buffer_;
  std::optional<boost::beast::http::request_parser<boost::beast::http::empty_body>> parser_;
  std::shared_ptr<Text> response_;
};

}  // namespace perimap
